#include "client/app/check_command.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "client/app/exit_code.h"
#include "common/visibility/mesh_check.h"

namespace umbriel {
namespace {

using Json = nlohmann::ordered_json;

Json jsonOf(const visibility::MeshReport& report) {
    Json json = {{"vertices", report.vertices},
                 {"triangles", report.triangles},
                 {"components", report.components},
                 {"closed", report.closed},
                 {"findings", Json::array()}};
    for (const visibility::MeshFinding& f : report.findings) {
        json["findings"].push_back(
            {{"condition", f.condition}, {"meaning", f.meaning}, {"count", f.count}, {"examples", f.examples}});
    }
    return json;
}

Result<visibility::Mesh> repaired(visibility::Mesh mesh, const CheckArguments& arguments, Json& json) {
    if (arguments.weld) {
        auto welded = visibility::weld(mesh, *arguments.weld);
        if (!welded) return welded.error();
        mesh = std::move(*welded);
    }
    if (arguments.orient) {
        auto oriented = visibility::orient(mesh);
        if (!oriented) return oriented.error();
        json["flipped"] = oriented->flipped;
        json["unorientable"] = oriented->unorientable;
        mesh = std::move(oriented->mesh);
    }
    return mesh;
}

Result<void> checkUsage(const CheckArguments& arguments) {
    if (arguments.weld && !(*arguments.weld >= 0.0 && std::isfinite(*arguments.weld))) {
        return badInput(fmt::format("--weld {}: expected a length in metres, 0 or more", *arguments.weld));
    }
    if (!arguments.out.empty() && !arguments.out.ends_with(".obj")) {
        return badInput(fmt::format("--out '{}': expected a name ending in .obj", arguments.out));
    }
    return {};
}

}  // namespace

Result<void> checkInput(const MeshInput& input, const CheckArguments& arguments, std::ostream& out) {
    if (const auto usage = checkUsage(arguments); !usage) return usage.error();
    auto whole = concatenated(input);
    if (!whole) return whole.error();
    Json json = {{"file", arguments.scene}};
    std::string text;
    if (input.parts.size() > 1) {
        for (const MeshInput::Part& part : input.parts) {
            const auto report = visibility::checkMesh(part.mesh);
            if (!report) return badInput(fmt::format("{}: {}: {}", arguments.scene, part.name, report.error().message));
            Json one = {{"name", part.name}};
            one.update(jsonOf(*report));
            json["geometries"].push_back(std::move(one));
            text += fmt::format("{}: {}\n", part.name, visibility::toText(*report));
        }
        text += "all together: ";
    }
    const auto report = visibility::checkMesh(*whole, {.polygons = input.polygons});
    if (!report) return badInput(fmt::format("{}: {}", arguments.scene, report.error().message));
    json["whole"] = jsonOf(*report);
    text += visibility::toText(*report);

    const std::uint64_t nonFinite = report->finding("non-finite-coordinates").count;
    const bool repair = arguments.weld || arguments.orient || !arguments.out.empty();
    if (repair && nonFinite == 0) {
        Json changes = Json::object();
        const auto mesh = repaired(*whole, arguments, changes);
        if (!mesh) return badInput(fmt::format("{}: {}", arguments.scene, mesh.error().message));
        const auto after = visibility::checkMesh(*mesh);
        if (!after) return badInput(fmt::format("{}: after welding: {}", arguments.scene, after.error().message));
        if (changes.contains("flipped")) {
            text += fmt::format("\n{} triangles turned around, {} edges cannot be made consistent\n",
                                changes["flipped"].get<std::uint64_t>(), changes["unorientable"].get<std::uint64_t>());
        }
        text += fmt::format("\nafter repair: {}", visibility::toText(*after));
        json["repaired"] = jsonOf(*after);
        json["repaired"].update(changes);
        if (!arguments.out.empty()) {
            if (const auto written = writeObj(arguments.out, *mesh); !written) return written.error();
            text += fmt::format("wrote {}\n", arguments.out);
        }
    }
    json["warnings"] = input.warnings;
    for (const std::string& warning : input.warnings) text += fmt::format("warning: {}\n", warning);
    out << (arguments.json ? json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n' : text);
    if (!out.flush()) return failure("the result could not be written");
    if (nonFinite > 0) {
        return badInput(fmt::format("{}: {} vertices have coordinates that are not finite; such a mesh cannot be baked",
                                    arguments.scene, nonFinite));
    }
    return {};
}

int runCheck(const CheckArguments& arguments, std::ostream& out, std::ostream& err) {
    Result<void> done = checkUsage(arguments);
    if (done) {
        const auto input = loadMeshes(arguments.scene, true);
        done = input ? checkInput(*input, arguments, out) : Result<void>(input.error());
    }
    return endCommand("umbriel check", done, err);
}

}  // namespace umbriel
