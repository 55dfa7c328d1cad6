// The images that shadows are made in in the view have as many samples as the target. With one they are plain ones: asked
// for a multisampled image of one sample, a driver may give four and look where the first of those lies, not at the
// pixel's centre (llvmpipe does).
#ifdef SEVERAL_SAMPLES
#define VIEW_IMAGE sampler2DMS
#define VIEW_LAYERS sampler2DMSArray
#define SAMPLE_INDEX gl_SampleID
#else
#define VIEW_IMAGE sampler2D
#define VIEW_LAYERS sampler2DArray
#define SAMPLE_INDEX 0
#endif
