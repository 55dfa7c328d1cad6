#include "client/app/stage.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "client/app/illumination_overrides.h"
#include "client/app/viewport_text.h"
#include "client/import/brdf_import.h"
#include "client/import/environment_import.h"
#include "client/import/intensity_table.h"
#include "client/session/camera.h"
#include "client/session/field_text.h"
#include "common/base/assert.h"
#include "common/light/environment_map.h"
#include "common/math/box.h"
#include "common/math/lafortune_fit.h"
#include "common/math/rotation.h"
#include "common/scene/lights.h"
#include "common/scene/materials.h"
#include "common/scene/shading_values.h"
#include "common/scene/traversal.h"

namespace umbriel {
namespace {

constexpr double kDefaultFovY = 45.0 * std::numbers::pi / 180.0;
// An inner cone of 90 % of the outer one: a visible soft edge, as of a real reflector.
constexpr double kInnerConeShare = 0.9;
// Radiance 1 from a white diffuse surface that faces the light.
constexpr float kDefaultIrradiance = std::numbers::pi_v<float>;

template <class Core>
void setOn(Aspect& scene, ContainerId core, bool on) {
    if (scene.findAs<Core>(core)) scene.edit(Ref<Core>(core)).template set<&Core::on>(on);
}

void switchOff(Aspect& scene, const std::vector<LightInEffect>& lights) {
    for (const LightInEffect& light : lights) {
        setOn<AmbientLight>(scene, light.core, false);
        setOn<DirectionalLight>(scene, light.core, false);
        setOn<PointLight>(scene, light.core, false);
        setOn<SpotLight>(scene, light.core, false);
        setOn<GoniometricLight>(scene, light.core, false);
    }
}

// Builds upwards: every light becomes a new root above everything, so it lights all of it; beacons stand beside the scene.
class LightChain {
   public:
    LightChain(Aspect& scene, Ref<Node> root) : _scene(scene), _root(root) {
        _beacons = scene.create<Node>("beacons");
        wrap(scene.create<Node>("stage"), {_beacons, root});
    }

    Ref<Node> root() const { return _root; }

    Ref<Node> addBeacon(const std::string& name, const glm::dvec3& position, const glm::dmat3& orientation, Ref<Transform>* pose) {
        const Ref<Transform> transform = _scene.create<Transform>(name);
        _scene.edit(transform).set<&Transform::linear>(glm::mat3(orientation)).set<&Transform::translation>(position);
        const Ref<Node> beacon = _scene.create<Node>(name);
        _scene.edit(beacon).set<&Node::core>(Ref<Container>(transform.id));
        _scene.edit(_beacons).append<&Node::children>(beacon);
        if (pose) *pose = transform;
        return beacon;
    }

    void add(const std::string& name, ContainerId core) {
        const Ref<Node> node = _scene.create<Node>(name);
        _scene.edit(node).set<&Node::core>(Ref<Container>(core));
        wrap(node, {_root});
    }

   private:
    void wrap(Ref<Node> node, const std::vector<Ref<Node>>& children) {
        _scene.edit(node).assign<&Node::children>(children);
        _root = node;
    }

    Aspect& _scene;
    Ref<Node> _root;
    Ref<Node> _beacons;
};

// What all lights take from the command line.
template <class Light>
void setShares(Edit<Light>& edit, Ref<Node> beacon, const LightArgument& light) {
    edit.template set<&Light::beacon>(beacon)
        .template set<&Light::ambientShare>(glm::vec3(light.ambientShare))
        .template set<&Light::highlightShare>(glm::vec3(light.highlightShare));
}

template <class Light>
void setLocal(Edit<Light>& edit, Ref<Node> beacon, const LightArgument& light, const glm::vec3& intensity) {
    setShares(edit, beacon, light);
    edit.template set<&Light::intensity>(intensity).template set<&Light::radius>(light.radius);
    if (light.attenuation)
        edit.template set<&Light::fade>(LightFade::Polynomial).template set<&Light::attenuation>(*light.attenuation);
}

Result<void> addLight(Aspect& scene, LightChain& chain, const LightArgument& light, const std::string& name,
                      const glm::dvec3& centre, Stage& stage) {
    const glm::dmat3 turned(glm::rotate(glm::dmat4(1.0), light.turn, glm::dvec3(0, 0, 1)));
    const Ref<Node> beacon =
        chain.addBeacon(name, light.position, lookingAlong(light.direction, {0, 1, 0}) * turned, nullptr);
    if (light.kind == LightArgument::Kind::Directional) {
        const Ref<DirectionalLight> core = scene.create<DirectionalLight>(name);
        auto edit = scene.edit(core);
        setShares(edit, beacon, light);
        edit.set<&DirectionalLight::irradiance>(light.power.value_or(glm::vec3(kDefaultIrradiance)));
        chain.add(name, core);
        return {};
    }
    // Bright enough that the middle of the scene gets what the default sun gives.
    const double distance = glm::distance(light.position, centre);
    const double fade =
        light.attenuation
            ? std::max(1.0, glm::dot(glm::dvec3(*light.attenuation), glm::dvec3(1.0, distance, distance * distance)))
            : distance * distance;
    const float matching = static_cast<float>(kDefaultIrradiance * std::max(fade, 1e-12));
    const glm::vec3 intensity = light.power.value_or(glm::vec3(matching));
    if (light.kind == LightArgument::Kind::Point) {
        const Ref<PointLight> core = scene.create<PointLight>(name);
        auto edit = scene.edit(core);
        setLocal(edit, beacon, light, intensity);
        chain.add(name, core);
        return {};
    }
    if (light.kind == LightArgument::Kind::Goniometric) {
        const auto luminaire = readPhotometricFile(light.file);
        if (!luminaire) return luminaire.error();
        for (const std::string& repair : luminaire->repairs) stage.warnings.push_back(light.file + ": " + repair);
        if (!(luminaire->web.maxIntensity() > 0.0)) stage.warnings.push_back(light.file + ": the luminaire is dark");
        const Ref<GoniometricLight> core = scene.create<GoniometricLight>(name);
        const glm::vec3 brightest =
            light.scale ? light.power.value_or(glm::vec3(1.0f)) *
                              static_cast<float>(static_cast<double>(*light.scale) * luminaire->web.maxIntensity())
                        : intensity;
        const Ref<IntensityTable> table = createIntensityTable(scene, *luminaire);
        auto edit = scene.edit(core);
        setLocal(edit, beacon, light, brightest);
        edit.set<&GoniometricLight::table>(table);
        chain.add(name, core);
        return {};
    }
    const Ref<SpotLight> core = scene.create<SpotLight>(name);
    auto edit = scene.edit(core);
    setLocal(edit, beacon, light, intensity);
    edit.set<&SpotLight::outerAngle>(static_cast<float>(0.5 * light.coneAngle))
        .set<&SpotLight::innerAngle>(static_cast<float>(0.5 * kInnerConeShare * light.coneAngle));
    if (light.exponent)
        edit.set<&SpotLight::falloff>(light.isProduct ? SpotFalloff::Product : SpotFalloff::Cone)
            .set<&SpotLight::exponent>(*light.exponent);
    chain.add(name, core);
    return {};
}

// The fog of all viewports; as bright as the background unless it says otherwise.
Ref<Fog> createFog(Aspect& scene, const StageOptions& options) {
    const FogArgument& argument = *options.fog;
    const Ref<Fog> fog = scene.create<Fog>("fog");
    auto edit = scene.edit(fog);
    edit.set<&Fog::mode>(argument.mode).set<&Fog::start>(argument.start).set<&Fog::end>(argument.end);
    edit.set<&Fog::density>(argument.density);
    if (argument.colour)
        edit.set<&Fog::colour>(*argument.colour);
    else if (options.background)
        edit.set<&Fog::colour>(*options.background);
    return fog;
}

Ref<Viewport> addViewport(Aspect& scene, const Stage& stage, const std::string& name, Ref<Container> camera,
                          const StageOptions& options) {
    const Ref<Viewport> viewport = scene.create<Viewport>(name);
    auto edit = scene.edit(viewport);
    edit.set<&Viewport::root>(stage.root);
    edit.set<&Viewport::camera>(camera);
    edit.set<&Viewport::shadowMode>(options.shadowMode);
    edit.set<&Viewport::show>(options.show);
    edit.set<&Viewport::mapSize>(options.mapSize);
    if (stage.fog) edit.set<&Viewport::fog>(stage.fog);
    if (options.background) {
        const Ref<ColourBackground> background = scene.create<ColourBackground>("background");
        scene.edit(background).set<&ColourBackground::colour>(glm::vec4(*options.background, 1.0f));
        edit.set<&Viewport::background>(Ref<Container>(background.id));
    } else if (stage.environment && !options.captureEnvironment) {
        const Ref<EnvironmentBackground> background = scene.create<EnvironmentBackground>("background");
        scene.edit(background).set<&EnvironmentBackground::light>(stage.environment);
        edit.set<&Viewport::background>(Ref<Container>(background.id));
    }
    scene.edit(stage.window).append<&Window::viewports>(viewport);
    return viewport;
}

// A wall of given metres need not have square pixels.
Result<void> fitToWall(Aspect& scene, Ref<Container> camera, const StageOptions& options) {
    if (!options.wallSize) return {};
    if (!scene.findAs<PerspectiveCamera>(camera.id))
        return badInput("--wall-size: the wall's distance follows from the field of view, so it needs a perspective camera");
    scene.edit(Ref<PerspectiveCamera>(camera.id)).set<&PerspectiveCamera::aspect>(options.wallSize->x / options.wallSize->y);
    return {};
}

// From the middle between the eyes to the wall: where a wall of this height fills the vertical field of view; 1 m when
// its size is not given.
Result<double> screenDistance(const Aspect& scene, Ref<Container> camera, const StageOptions& options) {
    const auto* perspective = scene.findAs<PerspectiveCamera>(camera.id);
    if (!perspective) return badInput("--stereo: two eyes need a perspective camera");
    if (!options.wallSize) return 1.0;
    return 0.5 * options.wallSize->y / std::tan(0.5 * perspective->fovY);
}

Result<Ref<Container>> namedCamera(const Aspect& scene, const LoadedScene& loaded, const std::string& name) {
    std::string known;
    for (const Ref<Container>& camera : loaded.cameras.toVector()) {
        const Container* container = scene.find(camera.id);
        if (!container) continue;
        if (container->name.get() == name) return camera;
        known += (known.empty() ? "'" : ", '") + container->name.get() + "'";
    }
    return badInput(known.empty() ? fmt::format("--camera '{}': the scene has no cameras", name)
                                  : fmt::format("--camera '{}': the scene has no such camera; it has {}", name, known));
}

}  // namespace

glm::dmat3 lookingAlong(const glm::dvec3& forward, const glm::dvec3& up) {
    const auto rotation = rotationLookingAlong(forward, up);
    UMBRIEL_ASSERT(rotation.has_value(), "a direction was not checked");
    return *rotation;
}

namespace {

// The residual falls with each lobe, and the fit takes several times longer.
constexpr int kFittedLobes = 2;

// A material of Lafortune lobes that are fitted to a measured BRDF.
Result<Ref<Material>> measuredMaterial(Aspect& scene, const std::string& file, std::vector<std::string>& notes) {
    const auto table = loadBrdf(file, notes);
    if (!table) return table.error();
    const auto fit = fitLafortune(*table, kFittedLobes);
    if (!fit) return badInput(fmt::format("{}: {}", file, fit.error().message));
    const glm::dvec3 residual = 100.0 * fit->residual;
    notes.push_back(
        fmt::format("{}: {} Lafortune lobes leave {:.1f} %, {:.1f} %, {:.1f} % of it (root mean square; red, "
                    "green, blue)",
                    file, fit->model.lobes.size(), residual.x, residual.y, residual.z));
    std::vector<glm::vec3> albedos, axes;
    std::vector<float> exponents;
    for (const LafortuneLobe& lobe : fit->model.lobes) {
        albedos.push_back(glm::vec3(lobe.weight));
        axes.push_back(glm::vec3(glm::dvec3(lobe.planar, lobe.planar, lobe.normal)));
        exponents.push_back(static_cast<float>(std::min(lobe.exponent, 1e4)));
    }
    const Ref<Material> material = scene.create<Material>(file);
    scene.edit(material)
        .set<&Material::model>(ReflectionModel::Lafortune)
        .set<&Material::baseColour>(glm::vec4(glm::vec3(fit->model.diffuse), 1.0f))
        .assign<&Material::lobeAlbedos>(albedos)
        .assign<&Material::lobeAxes>(axes)
        .assign<&Material::lobeExponents>(exponents);
    return material;
}

// Of everything: the innermost group counts, so none may keep its own.
void setEveryMaterial(Aspect& scene, Ref<Material> material) {
    const Ref<Container> chosen(material.id);
    for (const ContainerId id : scene.ids()) {
        if (scene.findAs<Geometry>(id)) scene.edit(Ref<Geometry>(id)).set<&Geometry::material>(chosen);
        if (scene.findAs<MaterialGroup>(id)) scene.edit(Ref<MaterialGroup>(id)).set<&MaterialGroup::material>(chosen);
    }
}

}  // namespace

// --shadow-set.
static Result<void> setFields(Aspect& scene, const Stage& stage, const StageOptions& options) {
    for (const std::string& text : options.shadowSet) {
        const std::size_t equals = text.find('=');
        if (equals == 0 || equals == std::string::npos)
            return badInput(fmt::format("--shadow-set '{}': expected FIELD=VALUE, as in offBias=0.5", text));
        const std::string field = text.substr(0, equals);
        const auto value = viewportFieldText(field, text.substr(equals + 1));
        if (!value) return badInput(fmt::format("--shadow-set {}: {}", field, value.error().message));
        for (const Ref<Viewport>& viewport : scene.get(stage.window).viewports.toVector())
            if (const auto set = setField(scene, viewport.id, field, *value); !set)
                return badInput("--shadow-set: " + set.error().message);
    }
    return {};
}

Result<Stage> buildStage(Aspect& scene, Ref<LoadedScene> loadedRef, const StageOptions& options, double aspectRatio) {
    const LoadedScene& loaded = scene.get(loadedRef);
    const Ref<Node> sceneRoot = loaded.root;
    GeometryBounds geometryBounds;
    const Box3d bounds = worldBounds(scene, sceneRoot, geometryBounds);
    const glm::dvec3 centre = bounds.empty() ? glm::dvec3(0.0) : bounds.centre();
    Stage stage;
    LightChain chain(scene, sceneRoot);

    const std::vector<LightInEffect> own = lightsInEffect(scene, sceneRoot, Hierarchy(scene, sceneRoot));
    if (options.noLights) {
        switchOff(scene, own);
    } else if (!options.lights.empty()) {
        if (!own.empty()) stage.notes.push_back(fmt::format("--light replaces the scene's own {} lights", own.size()));
        switchOff(scene, own);
        for (std::size_t i = 0; i < options.lights.size(); ++i) {
            const auto added = addLight(scene, chain, options.lights[i], fmt::format("light {}", i), centre, stage);
            if (!added) return added.error();
        }
    } else if (own.empty() && !options.environment.empty()) {
        stage.notes.push_back("the scene has no lights: the environment alone lights it");
    } else if (own.empty()) {
        stage.notes.push_back("the scene has no lights: a default sun and a weak ambient light are used");
        LightArgument sun;
        sun.direction = glm::normalize(kDefaultSunDirection);
        if (const auto added = addLight(scene, chain, sun, "default sun", centre, stage); !added) return added.error();
        const Ref<AmbientLight> ambient = scene.create<AmbientLight>("default ambient");
        scene.edit(ambient).set<&AmbientLight::radiance>(glm::vec3(kDefaultAmbientRadiance));
        chain.add("default ambient", ambient);
    }

    if (!options.brdf.empty()) {
        const auto material = measuredMaterial(scene, options.brdf, stage.notes);
        if (!material) return material.error();
        setEveryMaterial(scene, *material);
    }
    if (!options.environment.empty() || options.captureEnvironment) {
        stage.environment = scene.create<EnvironmentLight>("environment");
        if (!options.captureEnvironment) {
            const auto panorama = loadPanorama(options.environment, stage.notes);
            if (!panorama) return panorama.error();
            scene.edit(stage.environment).set<&EnvironmentLight::map>(addEnvironmentMap(scene, *panorama));
        }
        chain.add("environment", stage.environment);
    }

    // Our own camera stands by even when the file's is used: a viewer moves on from there.
    const CameraArguments& camera = options.camera;
    const double fovY = camera.fovDegrees ? *camera.fovDegrees * std::numbers::pi / 180.0 : kDefaultFovY;
    const LookAt framed = frameAll(bounds, fovY, aspectRatio);
    const glm::dvec3 target = camera.target.value_or(framed.targetWorld);
    // Looking at another point, the viewer keeps direction and distance.
    glm::dvec3 eye = camera.eye.value_or(target + (framed.eyeWorld - framed.targetWorld));
    if (eye == target) eye += framed.eyeWorld - framed.targetWorld;
    stage.cameraBeacon = chain.addBeacon("camera", eye, lookingAlong(target - eye, camera.up.value_or(framed.upWorld)), &stage.cameraPose);
    stage.ownCamera = scene.create<PerspectiveCamera>("umbriel camera");
    scene.edit(stage.ownCamera).set<&PerspectiveCamera::beacon>(stage.cameraBeacon).set<&PerspectiveCamera::fovY>(fovY);

    Ref<Container> chosen(stage.ownCamera.id);
    const bool described = camera.eye || camera.target || camera.up || camera.fovDegrees;
    if (!camera.name.empty()) {
        const auto named = namedCamera(scene, loaded, camera.name);
        if (!named) return named.error();
        chosen = *named;
    } else if (!described && !loaded.cameras.empty()) {
        chosen = loaded.cameras[0];
    }

    if (const auto fitted = fitToWall(scene, chosen, options); !fitted) return fitted.error();
    stage.root = chain.root();
    stage.window = scene.create<Window>("window");
    if (options.fog) stage.fog = createFog(scene, options);
    if (options.model) overrideModel(scene, *options.model);
    if (options.shading) overrideShading(scene, *options.shading);
    for (std::string& repair : repairShadingValues(scene)) stage.warnings.push_back(std::move(repair));
    if (!options.stereo) {
        stage.viewport = addViewport(scene, stage, "viewport", chosen, options);
        if (const auto set = setFields(scene, stage, options); !set) return set.error();
        return stage;
    }
    // Both eyes belong to the picture even when one of them is drawn: shadow maps are fitted to both.
    const auto distance = screenDistance(scene, chosen, options);
    if (!distance) return distance.error();
    for (const Eye eye : {Eye::Left, Eye::Right}) {
        const std::string name = eye == Eye::Left ? "left eye" : "right eye";
        const Ref<StereoCameraDecorator> decorator = scene.create<StereoCameraDecorator>(name);
        scene.edit(decorator)
            .set<&StereoCameraDecorator::camera>(chosen)
            .set<&StereoCameraDecorator::eye>(eye)
            .set<&StereoCameraDecorator::separation>(options.stereo->separation)
            .set<&StereoCameraDecorator::zeroParallax>(*distance);
        const Ref<Viewport> viewport = addViewport(scene, stage, name, Ref<Container>(decorator.id), options);
        if (eye == Eye::Left) stage.viewport = viewport;
    }
    if (const auto set = setFields(scene, stage, options); !set) return set.error();
    return stage;
}

}  // namespace umbriel
