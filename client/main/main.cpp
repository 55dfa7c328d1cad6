// The umbriel program: argument parsing only; every command lives in client/app.

#include <CLI/CLI.hpp>
#include <charconv>
#include <filesystem>
#include <iostream>

#include "client/app/bake_atlas_command.h"
#include "client/app/bake_command.h"
#include "client/app/check_command.h"
#include "client/app/compare_command.h"
#include "client/app/doctor_command.h"
#include "client/app/hdr_command.h"
#include "client/app/light_map_command.h"
#include "client/app/models_command.h"
#include "client/app/render_command.h"
#include "client/app/sheet_command.h"
#include "client/app/trade_command.h"
#include "client/app/view_command.h"
#include "client/import/import_child.h"
#include "common/base/log.h"
#include "client/app/arguments.h"

namespace {

using namespace umbriel;

// Where umbriel-server lies: beside this program.
std::filesystem::path serverBesideThisProgram() {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    return error ? std::filesystem::path("umbriel-server") : self.parent_path() / "umbriel-server";
}

// An empty value is a script's variable that is not set, never "the default".
CLI::Validator given() {
    return CLI::Validator([](std::string& value) { return std::string(value.empty() ? "its value is empty" : ""); }, "");
}

// Options without a sign: CLI11 takes "-1" for 2^64 - 1, and all that is beyond 64 bits too.
void requireWholeNumbers(CLI::App& app) {
    const auto wholeNumber = [](std::string& value) -> std::string {
        std::uint64_t number = 0;
        const std::size_t skipped = value.starts_with("0x") ? 2 : value.starts_with('+') ? 1 : 0;
        const auto [end, error] = std::from_chars(value.data() + skipped, value.data() + value.size(), number, skipped == 2 ? 16 : 10);
        if (error == std::errc() && end == value.data() + value.size()) return "";
        if (error == std::errc::result_out_of_range) return "'" + value + "' is too large";
        return "'" + value + "': expected a whole number, 0 or more";
    };
    for (CLI::Option* option : app.get_options())
        if (option->get_type_name() == "UINT") option->check(CLI::Validator(wholeNumber, ""));
    for (CLI::App* command : app.get_subcommands(nullptr)) requireWholeNumbers(*command);
}

void addSceneOptions(CLI::App& command, SceneArguments& arguments) {
    command
        .add_option("SCENE", arguments.scene,
                    "a .gltf, .glb or .obj file, or demo:city, demo:car, demo:cloth, demo:palms, demo:spheres?n=N, demo:torus?n=N")
        ->required();
    command
        .add_option("--servers", arguments.servers,
                    "servers that run already: HOST:PORT or NAME=HOST:PORT, separated by commas")
        ->check(given());
    command
        .add_option("--listen", arguments.listen,
                    "HOST:PORT where servers dial this client (umbriel-server --connect); NAMEs among --servers do")
        ->check(given());
    command.add_option("--servers-expected", arguments.serversExpected,
                       "so many servers dial in, whatever their names");
    command.add_option("--connect-timeout", arguments.connectTimeout,
                       "seconds until all servers must be there (default: 5; with --listen 60)");
    command.add_flag(
        "--start-incomplete", arguments.startIncomplete,
        "with --policy strict or degrade: start with the servers that are there by then, others join later");
    command.add_option("--local", arguments.local, "start this many servers on this machine (default: one per tile, at most 16)");
    command.add_option("--grid", arguments.grid, "the wall's tiles, COLUMNSxROWS")->capture_default_str();
    command.add_option("--size", arguments.size, "the whole wall in pixels, WIDTHxHEIGHT")->capture_default_str();
    command.add_option("--camera", arguments.camera, "a camera of the file, by name (default: its first, else all in view)")
        ->check(given());
    command.add_option("--eye", arguments.eye, "where the camera stands, x,y,z in metres");
    command.add_option("--target", arguments.target, "what it looks at, x,y,z");
    command.add_option("--up", arguments.up, "what is up, x,y,z (default 0,1,0)");
    command.add_option("--fov", arguments.fov, "vertical field of view in degrees");
    command.add_option("--stereo", arguments.stereo, "left, right or pair: off-axis eyes before the wall; pairs go to x.left, x.right");
    command.add_option("--wall-size", arguments.wallSize, "of the wall in metres, WxH; with the field of view it gives the distance");
    command.add_option("--eye-separation", arguments.eyeSeparation, "metres between the eyes (default: 0.065)");
    command.add_option("--shadow", arguments.shadow, "shadow mode; auto: what umbriel trade stored for the scene, else none")
        ->capture_default_str();
    command.add_option("--frame-budget", arguments.frameBudget,
                       "milliseconds: steps along the front that umbriel trade stored for the scene, all servers together");
    command
        .add_option("--shadow-set", arguments.shadowSet,
                    "FIELD=VALUE: any field of the viewport, as in offBias=0.5; repeatable")
        ->allow_extra_args(false);
    command.add_option("--light-map", arguments.lightMap,
                       "what --shadow light-map looks up, of umbriel bake --light-map (default: SCENE.umlight)");
    command.add_option("--map-size", arguments.mapSize, "shadow map size in texels; 0: the largest power of two within the wall")
        ->capture_default_str();
    command
        .add_option(
            "--light", arguments.lights,
            "dir:x,y,z | point:x,y,z | spot:x,y,z:dx,dy,dz:deg | goniometric:FILE:x,y,z:dx,dy,dz, optionally "
            "@r,g,b[,KEY=VALUE...] (W/m2 or W/sr, linear; radius, attenuation=KC/KL/KQ, exponent, product, ambient, "
            "highlight, turn, scale); directions are the way the light travels, deg is the cone's full opening; "
            "repeatable; replaces the scene's own lights; none: no light at all")
        ->allow_extra_args(false);  // one value each time, so that SCENE may follow
    command.add_option("--model", arguments.model,
                       "reflection model of every material (default: each its own): lambert, phong, ...");
    command.add_option("--shading", arguments.shading,
                       "where every geometry is shaded: flat, flat-mean, gouraud, phong (pixels)");
    command.add_option("--fog", arguments.fog,
                       "linear:START:END, quadratic:START:END, exp:DENSITY, exp2:DENSITY, optionally @r,g,b");
    command.add_option("--background", arguments.background,
                       "r,g,b linear (default: the environment, without one transparent black)");
    command.add_option(
        "--environment", arguments.environment,
        "light from all around: a panorama (.exr, .hdr, .png), or capture:x,y,z[:TIMES], the scene as it "
        "is seen from there, TIMES over so that mirrors show mirrors (default 1, at most 8)");
    command.add_option("--brdf", arguments.brdf,
                       "a measured BRDF (.binary of the MERL database, or text: theta_in theta_out phi r g b): all surfaces "
                       "get Lafortune lobes fitted to it; --log-level info says how well they fit");
    command.add_option("--samples", arguments.samples, "samples per pixel, 1 or 4")->capture_default_str();
    command.add_option("--colour-bits", arguments.colourBits,
                       "of a channel of the colours that servers draw and send, 8, 16 or 32 (default: 16 for what is "
                       "looked at, 32 for .exr, .hdr, layers and what is judged)");
    command.add_option("--tiles", arguments.tiles, "exact: bit-equal to one server, needs wall-sized targets; offset")
        ->capture_default_str();
    command.add_option("--policy", arguments.policy,
                       "a late or lost server: wait (it is waited for, its loss is an error), strict (2 s), degrade (about three "
                       "frames); the wall then goes on, the tile holds its last picture until the server is back")
        ->capture_default_str();
    command.add_option("--latency", arguments.latency, "0 or 1: prepare the next frame while the servers draw")->capture_default_str();
    command.add_flag("--insecure-lan", arguments.insecureLan, "allow unencrypted servers beyond this machine");
    command.add_flag("--quiet", arguments.quiet, "print errors only");
    command.add_option("--log-level", arguments.logLevel, "trace, debug, info, warning, error, off")->capture_default_str();
}

void addBakeOptions(CLI::App& command, BakeArguments& arguments) {
    command.add_option("MESH", arguments.scene, "a .gltf, .glb or .obj file, or demo:NAME");
    command.add_option("--mapping", arguments.mapping, "hemicube, singleplane, hemisphere, cube, octahedral, fibonacci")
        ->capture_default_str();
    command.add_option("--size", arguments.size, "of an image, S: hemisphere has 2S x S/2 directions; fibonacci: how many directions")
        ->capture_default_str();
    command.add_option("--maker", arguments.maker, "rays, grid; gl: drawn by render servers (--servers, --local; default one here)")->capture_default_str();
    command.add_option("--far", arguments.far, "how far rays go, percent of the mesh's diagonal (default: no limit)");
    command.add_option("--fovy", arguments.fovy, "opening angle of singleplane in degrees");
    command.add_option("--guard", arguments.guard, "exact, fast, fast-fan: how rays are kept from hitting their own surface")
        ->capture_default_str();
    command.add_option("--threads", arguments.threads, "0: all processors")->capture_default_str();
    command.add_option("--shards", arguments.shards, "how many pieces the work is cut into; 0: chosen")->capture_default_str();
    command.add_option("--shard", arguments.shard, "bake only part i of n, i from 0: i/n; put together by bake merge");
    command.add_flag("--resume", arguments.resume, "go on with an interrupted bake into the same file");
    command.add_flag("--distance", arguments.distance, "signed distance maps as well");
    command.add_flag("--hit-distance", arguments.hitDistance, "distances of the nearest hits as well");
    command.add_flag("--index", arguments.index, "index maps as well: which environment texel an open direction sees");
    command.add_option("--environment", arguments.environment, "texels of that environment, WIDTHxHEIGHT")->capture_default_str();
    command.add_option("--atlas", arguments.atlas, "the maps as a picture too, .exr");
    command.add_option("--out", arguments.out, "the maps, .umvis");
    command
        .add_option("--servers", arguments.servers,
                    "bake on servers that run already: HOST:PORT or NAME=HOST:PORT, separated by commas")
        ->check(given());
    command.add_option("--local", arguments.local, "bake on so many servers of this machine, started for it");
    command.add_option("--audit", arguments.audit, "percent of the shards that two servers bake, and that must agree")
        ->capture_default_str();
    command.add_flag("--insecure-lan", arguments.insecureLan, "allow unencrypted servers beyond this machine");
    command.add_option("--light-map", arguments.lightMap,
                       "instead: shadows of the scene's static lights in an atlas of N x N texels, for --shadow light-map");
    command
        .add_option("--from", arguments.from,
                    "light maps: rays, or the shadow mode they are drawn with: std, pcf, ppcf, cube, dual-paraboloid")
        ->capture_default_str();
    command.add_option("--map-size", arguments.mapSize,
                       "light maps from a mode: texels of its shadow maps (default: 2048)");
    command
        .add_option("--shadow-set", arguments.shadowSet,
                    "light maps from a mode: FIELD=VALUE, as of render; repeatable")
        ->allow_extra_args(false);
    command.add_option("--samples", arguments.texelSamples, "light maps: points along each side of a texel")
        ->capture_default_str();
    command.add_option("--light-samples", arguments.lightSamples,
                       "light maps: rays along each side of a light with a size, from each point")
        ->capture_default_str();
    command.add_option("--light", arguments.lights, "light maps: lights in place of the scene's own, as of render")
        ->allow_extra_args(false);
    command.add_option("--moving", arguments.moving, "light maps: a node that will be moved, by name; repeatable")
        ->allow_extra_args(false);
    command.add_flag("--json", arguments.json, "print what was done and measured as JSON");
    command.add_flag("--quiet", arguments.quiet, "print errors only");
    command.footer("Example: umbriel bake dress.obj --mapping hemisphere --size 32 --out dress.umvis");
}

// CLI11 reports usage errors by exception; they end here.
int parse(CLI::App& app, int argc, char** argv) {
    try {
        app.parse(argc, argv);
        return -1;
    } catch (const CLI::CallForHelp&) {
        std::cout << app.help();
        return 0;
    } catch (const CLI::CallForAllHelp&) {
        std::cout << app.help("", CLI::AppFormatMode::All);
        return 0;
    } catch (const CLI::CallForVersion&) {
        std::cout << "umbriel " << UMBRIEL_VERSION << '\n';
        return 0;
    } catch (const CLI::ParseError& error) {
        std::cerr << "error: " << error.what() << "\nTry 'umbriel --help' or 'umbriel COMMAND --help'.\n";
        return 2;
    }
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"Umbriel: one scene on many displays, with measured shadows."};
    app.set_version_flag("--version", std::string("umbriel ") + UMBRIEL_VERSION);
    app.require_subcommand(1);
    app.footer("Examples:\n"
               "  umbriel render demo:city --grid 2x2 --size 1280x720 --shadow std --out wall.png\n"
               "  umbriel render scene.glb --servers left=render1:7420,right=render2:7420 --grid 2x1 --out wall.exr\n"
               "  umbriel compare wall.exr one.exr --json\n"
               "  umbriel view demo:car\n"
               "  umbriel trade demo:palms --out palms.html\n"
               "  umbriel check dress.obj\n"
               "  umbriel bake dress.obj --size 32 --out dress.umvis\n"
               "  umbriel doctor\n"
               "Exit codes: 0 done, 1 failed, 2 wrong usage or bad input.");

    const auto addShow = [](CLI::App& command, SceneArguments& arguments) {
        command
            .add_option("--show", arguments.show,
                        "how shadows are made in place of the picture: light-view, shadow-map, color-map, factor-map, "
                        "edge-map, seen-area")
            ->capture_default_str();
    };
    RenderArguments render;
    CLI::App* renderCommand = app.add_subcommand("render", "draw one or more frames off screen into EXR or PNG files");
    addSceneOptions(*renderCommand, render.scene);
    addShow(*renderCommand, render.scene);
    renderCommand->add_option("--out", render.out, "x.exr, x.hdr, x.png, a pattern such as x.%04d.exr, or a folder; repeatable")
        ->allow_extra_args(false);
    renderCommand->add_option("--layers", render.layers, "further EXR layers: depth,position,normal,ids,light");
    renderCommand->add_option("--frames", render.frames, "how many frames")->capture_default_str();
    renderCommand->add_option("--fps", render.fps, "frames per second of the animation")->capture_default_str();
    renderCommand->add_option("--exposure", render.exposure, "exposure of PNG files in EV")->capture_default_str();
    renderCommand->add_option("--tone-mapping", render.toneMapping, "of PNG files: clamp, exposure, reinhard, aces")
        ->capture_default_str();
    renderCommand->add_flag("--json", render.json, "print what was done and measured as JSON");
    renderCommand->add_flag("--explain", render.explain, "print each server's frame plan: passes, shader variants, bytes");
    renderCommand->footer("Example: umbriel render demo:car --grid 3x1 --size 1920x540 --shadow std --frames 25 --out car.%04d.exr");

    TradeArguments trade;
    CLI::App* tradeCommand = app.add_subcommand("trade", "what each shadow technique costs on a scene, and how wrong it is");
    addSceneOptions(*tradeCommand, trade.scene);
    tradeCommand->get_option("SCENE")->required(false);
    tradeCommand->add_option("--techniques", trade.techniques,
                             "shadow modes, separated by commas, each with :scene or :per-view for another fit, "
                             "light-map:MODE baked from one (default: all)");
    tradeCommand->add_option("--map-sizes", trade.mapSizes, "texels, separated by commas")->capture_default_str();
    tradeCommand->add_option("--filters", trade.filters, "filter widths of pcf, separated by commas (default: its own)");
    tradeCommand->add_option("--filter-samples", trade.samples, "samples a row of pcf and ppcf, separated by commas (default: their own)");
    tradeCommand->add_option("--frames", trade.frames, "timed frames for each setting")->capture_default_str();
    tradeCommand->add_option("--light-size", trade.lightSize, "of all lights, metres, of directional ones radians: soft truth");
    tradeCommand->add_option("--light-samples", trade.lightSamples, "rays to such a light")->capture_default_str();
    tradeCommand->add_option("--judge", trade.judge, "only surfaces of nodes with this name, or below one: for planar shadows");
    tradeCommand->add_flag("--both-sides", trade.bothSides, "judge surfaces lit from behind as if light shone through");
    tradeCommand->add_option("--flicker", trade.flicker, "frames of a slow move over which flicker is measured; 0: none")->capture_default_str();
    tradeCommand->add_option("--max-error", trade.maxError, "choose the cheapest setting whose error is at most this share, as in 0.005");
    tradeCommand->add_option("--budget", trade.budget, "choose the most accurate setting whose frames take at most this many milliseconds");
    tradeCommand->add_flag("--store", trade.store, "store the choice and the front beside the scene (SCENE.umtrade.json), for render and view");
    tradeCommand->add_option("--preset", trade.preset, "an experiment instead of a sweep:\n" + tradePresets());
    tradeCommand->add_option("--out", trade.out, ".csv, .json or .html; repeatable")->allow_extra_args(false);
    tradeCommand->add_flag("--json", trade.json, "print JSON");
    tradeCommand->footer("Example: umbriel trade demo:palms --techniques std,lisp --map-sizes 512,1024 --max-error 0.01 --out palms.html");

    ViewArguments view;
    CLI::App* viewCommand = app.add_subcommand("view", "look at a scene in a window");
    addSceneOptions(*viewCommand, view.scene);
    addShow(*viewCommand, view.scene);
    viewCommand->add_option("--frames", view.frames, "close after this many frames; 0: when the user closes the window")
        ->capture_default_str();
    viewCommand->footer("Example: umbriel view demo:car --shadow std\nDrag: orbit. Right drag or shift: pan. Wheel: distance. Space: stop and start the animation. Tab: the shadows' panel: up and down choose a field, left and right step it, or type its value and Enter. Esc: close.");

    ModelsArguments models;
    models.scene.size = "320x240";
    CLI::App* modelsCommand = app.add_subcommand(
        "models", "one scene under every reflection model and shading frequency: pictures and figures");
    addSceneOptions(*modelsCommand, models.scene);
    modelsCommand->add_option("--out", models.out, "all pictures on one sheet, .png");
    modelsCommand->add_option("--frames", models.frames, "drawn for the cost; the quickest counts")
        ->capture_default_str();
    modelsCommand->add_flag("--json", models.json, "print JSON");
    modelsCommand->footer("Example: umbriel models demo:torus?n=20 --out models.png");

    SheetArguments sheet;
    CLI::App* sheetCommand = app.add_subcommand("sheet", "scenes under every shadow mode, on one picture");
    addSceneOptions(*sheetCommand, sheet.scene);
    sheetCommand->add_option("--also", sheet.also, "a further scene; repeatable")->allow_extra_args(false);
    sheetCommand->add_option("--techniques", sheet.techniques,
                             "as those of umbriel trade, separated by commas (default: every mode)");
    sheetCommand->add_option("--columns", sheet.columns, "pictures beside each other")->capture_default_str();
    sheetCommand->add_option("--levels", sheet.levels, "of each colour channel; fewer make a smaller file")
        ->capture_default_str();
    sheetCommand->add_option("--out", sheet.out, "the picture, .png")->required();
    sheetCommand->footer("Example: umbriel sheet demo:palms --also demo:city --out shadows.png");

    CompareOptions compare;
    std::string compareA, compareB, compareGrid;
    CLI::App* compareCommand = app.add_subcommand("compare", "measure how two pictures differ");
    compareCommand->add_option("A", compareA, "an .exr, .png or .hdr file")->required();
    compareCommand->add_option("B", compareB, "another of the same size")->required();
    compareCommand->add_option("--exposure", compare.exposure, "EV before clamping and rounding to 8 bits")->capture_default_str();
    compareCommand->add_option("--grid", compareGrid, "measure each tile of COLUMNSxROWS as well");
    compareCommand->add_option("--measures", compare.measures, "basic, or all: edges, Mach bands, colour difference too")
        ->capture_default_str();
    compareCommand->add_option("--threshold", compare.threshold, "for the share of pixels that differ by more")->capture_default_str();
    compareCommand->add_flag("--json", compare.json, "print JSON");
    compareCommand->footer("Example: umbriel compare one.exr wall.exr --grid 2x2");

    HdrOptions hdr;
    CLI::App* hdrCommand = app.add_subcommand("hdr", "a radiance map from photographs with different exposure times");
    hdrCommand->add_option("PHOTOGRAPHS", hdr.photographs, "JPEG or PNG files of one still scene")->required();
    hdrCommand->add_option("--times", hdr.times, "seconds, as in 1/30,1/15, in the order of the photographs; @FILE; default: EXIF");
    hdrCommand->add_option("--merge", hdr.merge, "weighted, or nearest to mid-range")->capture_default_str();
    hdrCommand->add_option("--smoothness", hdr.smoothness, "of the response curve")->capture_default_str();
    hdrCommand->add_option("--out", hdr.outs, ".exr, .hdr or .png; repeatable")->allow_extra_args(false);
    hdrCommand->add_option("--tone-mapping", hdr.toneMapping, "of a .png: clamp, exposure, reinhard, aces")->capture_default_str();
    hdrCommand->add_option("--exposure", hdr.exposure, "of a .png, in EV (default: the mean of the logarithms becomes 0.18)");
    hdrCommand->add_flag("--json", hdr.json, "print JSON");
    hdrCommand->footer("Example: umbriel hdr IMG_*.jpg --out room.exr --out room.png");

    CheckArguments check;
    CLI::App* checkCommand = app.add_subcommand("check", "whether a mesh is fit for visibility maps");
    checkCommand->add_option("FILE", check.scene, "a .gltf, .glb or .obj file, or demo:NAME")->required();
    checkCommand->add_option("--weld", check.weld, "vertices nearer than this become one, metres; 0: equal coordinates");
    checkCommand->add_flag("--orient", check.orient, "the same winding within each component, closed ones outwards");
    checkCommand->add_option("--out", check.out, "write the mesh after welding and orienting, .obj");
    checkCommand->add_flag("--json", check.json, "print JSON");
    checkCommand->footer("Example: umbriel check dress.obj --weld 0.0001 --orient --out dress-sound.obj");

    BakeArguments bake;
    CLI::App* bakeCommand = app.add_subcommand("bake", "make visibility maps of a mesh");
    addBakeOptions(*bakeCommand, bake);
    BakeMergeArguments bakeMerge;
    CLI::App* bakeMergeCommand = bakeCommand->add_subcommand("merge", "one file of those that --shard i/n made");
    bakeMergeCommand->add_option("SHARD", bakeMerge.shards, "all of them, in any order")->required();
    bakeMergeCommand->add_option("--out", bakeMerge.out, "the whole file, .umvis")->required();
    bakeMergeCommand->add_flag("--allow-mixed", bakeMerge.allowMixed, "although last bits may differ between their bake classes");
    bakeMergeCommand->add_flag("--json", bakeMerge.json, "print JSON");

    BakeExportArguments bakeExport;
    CLI::App* bakeExportCommand = bakeCommand->add_subcommand("export", "maps as an OpenEXR picture");
    bakeExportCommand->add_option("FILE", bakeExport.maps, "the maps, .umvis")->required();
    bakeExportCommand->add_option("--out", bakeExport.out, "the picture, .exr; .png: for eyes only")->required();
    bakeExportCommand->add_option("--rows", bakeExport.rows, "only these rows of the file, as in 12,40")->delimiter(',');
    bakeExportCommand->add_option("--vertices", bakeExport.vertices, "only the maps of these vertices of the mesh as loaded, from 0")
        ->delimiter(',');
    bakeExportCommand->add_option("--columns", bakeExport.columns, "maps beside each other; 0: about a square");
    bakeExportCommand->add_flag("--show-distance", bakeExport.showDistance, "the distance maps as grey in place of the masks");
    bakeExportCommand->add_option("--scale", bakeExport.scale, "of a .png: pixels for each direction")->capture_default_str();
    bakeExportCommand->add_flag("--json", bakeExport.json, "print JSON");
    bakeExportCommand->footer("Example: umbriel bake export dress.umvis --out dress.exr");
    BakeImportArguments bakeImport;
    CLI::App* bakeImportCommand = bakeCommand->add_subcommand("import", "maps back from a picture that export made of all of them");
    bakeImportCommand->add_option("FILE", bakeImport.picture, "the picture, .exr")->required();
    bakeImportCommand->add_option("--mesh", bakeImport.mesh, "what the maps were baked of")->required();
    bakeImportCommand->add_option("--out", bakeImport.out, "the maps, .umvis")->required();
    bakeImportCommand->add_flag("--json", bakeImport.json, "print JSON");
    bakeImportCommand->footer("Example: umbriel bake import dress.exr --mesh dress.obj --out dress.umvis");

    DoctorOptions doctor;
    CLI::App* doctorCommand = app.add_subcommand("doctor", "say what works on this machine");
    doctorCommand->add_flag("--json", doctor.json, "print JSON");
    doctorCommand->footer("Example: umbriel doctor --json");

    ImportChildOptions importChild;
    CLI::App* importChildCommand = app.add_subcommand("import-child", "internal: parse a file for the client");
    importChildCommand->group("");
    importChildCommand->add_option("ARGUMENTS", importChild.arguments);

    requireWholeNumbers(app);
    if (const int code = parse(app, argc, argv); code >= 0) return code;

    const auto setLogLevel = [](const std::string& level) {
        if (log::setLevel(level)) return true;
        std::cerr << "error: --log-level '" << level << "': expected trace, debug, info, warning, error or off\n";
        return false;
    };
    if (*importChildCommand) return runImportChild(importChild);
    if (render.scene.quiet) render.scene.logLevel = "error";
    if (view.scene.quiet) view.scene.logLevel = "error";
    if (*renderCommand) {
        if (!setLogLevel(render.scene.logLevel)) return 2;
        return runRender(render, serverBesideThisProgram(), std::cout);
    }
    if (models.scene.quiet) models.scene.logLevel = "error";
    if (*modelsCommand) {
        if (!setLogLevel(models.scene.logLevel)) return 2;
        return runModels(models, serverBesideThisProgram(), std::cout);
    }
    if (sheet.scene.quiet) sheet.scene.logLevel = "error";
    if (*sheetCommand) {
        if (!setLogLevel(sheet.scene.logLevel)) return 2;
        return runSheet(sheet, serverBesideThisProgram());
    }
    if (*viewCommand) {
        if (!setLogLevel(view.scene.logLevel)) return 2;
        return runView(view, serverBesideThisProgram());
    }
    if (trade.scene.quiet) trade.scene.logLevel = "error";
    if (*tradeCommand) {
        if (!setLogLevel(trade.scene.logLevel)) return 2;
        if (trade.scene.scene.empty() && trade.preset.empty()) {
            std::cerr << "error: SCENE is missing: umbriel trade SCENE, or --preset NAME\n";
            return 2;
        }
        return runTrade(trade, serverBesideThisProgram(), std::cout);
    }
    if (*checkCommand) return runCheck(check, std::cout, std::cerr);
    if (*bakeMergeCommand) return runBakeMerge(bakeMerge, std::cout, std::cerr);
    if (*bakeExportCommand) return runBakeExport(bakeExport, std::cout, std::cerr);
    if (*bakeImportCommand) return runBakeImport(bakeImport, std::cout, std::cerr);
    if (*bakeCommand) {
        if (bake.scene.empty()) {
            std::cerr << "error: MESH is missing: umbriel bake MESH --out FILE.umvis\n";
            return 2;
        }
        if (bake.lightMap) {
            if (bake.quiet) log::setLevel("error");
            return runBakeLightMap(bake, std::cout, std::cerr);
        }
        return runBake(bake, std::cout, std::cerr);
    }
    if (*hdrCommand) return runHdr(hdr, std::cout, std::cerr);
    if (*compareCommand) {
        compare.a = compareA;
        compare.b = compareB;
        if (!compareGrid.empty()) {
            const auto grid = parseGrid("--grid", compareGrid);
            if (!grid) return exitCodeOf(grid.error());
            compare.grid = {grid->columns, grid->rows};
        }
        return runCompare(compare, std::cout, std::cerr);
    }
    return runDoctor(doctor, serverBesideThisProgram(), std::cout);
}
