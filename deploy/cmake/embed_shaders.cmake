# Writes embedded_shaders.cpp: one raw string per shader file, looked up by its path below shaders/.
set(text "#include \"shaders/embedded.h\"\n\nnamespace umbriel::shaders {\nnamespace {\nconst ShaderFile kFiles[] = {\n")
foreach(file IN LISTS FILES)
  file(READ ${ROOT}/${file} content)
  # MSVC-sized literals are no concern here, yet pieces keep every compiler happy.
  string(APPEND text "    {\"${file}\", R\"glsl(${content})glsl\"},\n")
endforeach()
string(APPEND text "    {\"\", \"\"}};\n}\nstd::span<const ShaderFile> embeddedFiles() { return {kFiles, std::size(kFiles) - 1}; }\n}\n")
file(WRITE ${OUTPUT} "${text}")
