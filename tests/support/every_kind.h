#pragma once

#include "common/scene/container.h"
#include "common/scene/nodes.h"
#include "common/scene/type_descriptor.h"

namespace umbriel::test {

enum class Season : std::uint32_t { Spring, Summer, Autumn, Winter };

}  // namespace umbriel::test

template <>
inline constexpr std::uint32_t umbriel::kEnumCount<umbriel::test::Season> = 4;

namespace umbriel::test {

// A type as an application would add one: this declaration is all there is of it. It has fields of every kind.
struct EveryKind : Container {
    static constexpr std::string_view kTypeName = "EveryKind";
    Single<bool> flag{true};
    Single<std::uint8_t> byte{std::uint8_t{1}};
    Single<std::uint16_t> word{std::uint16_t{2}};
    Single<std::uint32_t> dword{3u};
    Single<std::int32_t> integer{-4};
    Single<std::uint64_t> qword{std::uint64_t{5}};
    Single<float> real{6.5f};
    Single<double> wide{7.25};
    Single<glm::vec2> vec2{glm::vec2(1, 2)};
    Single<glm::vec3> vec3{glm::vec3(1, 2, 3)};
    Single<glm::vec4> vec4{glm::vec4(1, 2, 3, 4)};
    Single<glm::dvec3> dvec3{glm::dvec3(1, 2, 3)};
    Single<glm::mat3> mat3{glm::mat3(1)};
    Single<glm::mat4> mat4{glm::mat4(1)};
    Single<glm::dmat4> dmat4{glm::dmat4(1)};
    Single<ContainerId> id;
    Single<std::string> text{std::string("text")};
    Single<Season> season{Season::Autumn};
    Single<Ref<Node>> node;
    Multi<std::uint8_t> bytes;
    Multi<std::uint16_t> words;
    Multi<std::uint32_t> dwords;
    Multi<std::int32_t> integers;
    Multi<std::uint64_t> qwords;
    Multi<float> reals;
    Multi<double> wides;
    Multi<glm::vec2> vec2s;
    Multi<glm::vec3> vec3s;
    Multi<glm::vec4> vec4s;
    Multi<glm::dvec3> dvec3s;
    Multi<glm::mat3> mat3s;
    Multi<glm::mat4> mat4s;
    Multi<glm::dmat4> dmat4s;
    Multi<ContainerId> ids;
    Multi<Season> seasons;
    Multi<Ref<Node>> nodes;

    static void declare(TypeBuilder<EveryKind>& type) {
        type.field<&EveryKind::flag>("flag");
        type.field<&EveryKind::byte>("byte");
        type.field<&EveryKind::word>("word");
        type.field<&EveryKind::dword>("dword");
        type.field<&EveryKind::integer>("integer");
        type.field<&EveryKind::qword>("qword");
        type.field<&EveryKind::real>("real");
        type.field<&EveryKind::wide>("wide");
        type.field<&EveryKind::vec2>("vec2");
        type.field<&EveryKind::vec3>("vec3");
        type.field<&EveryKind::vec4>("vec4");
        type.field<&EveryKind::dvec3>("dvec3");
        type.field<&EveryKind::mat3>("mat3");
        type.field<&EveryKind::mat4>("mat4");
        type.field<&EveryKind::dmat4>("dmat4");
        type.field<&EveryKind::id>("id");
        type.field<&EveryKind::text>("text");
        type.field<&EveryKind::season>("season");
        type.field<&EveryKind::node>("node");
        type.field<&EveryKind::bytes>("bytes");
        type.field<&EveryKind::words>("words");
        type.field<&EveryKind::dwords>("dwords");
        type.field<&EveryKind::integers>("integers");
        type.field<&EveryKind::qwords>("qwords");
        type.field<&EveryKind::reals>("reals");
        type.field<&EveryKind::wides>("wides");
        type.field<&EveryKind::vec2s>("vec2s");
        type.field<&EveryKind::vec3s>("vec3s");
        type.field<&EveryKind::vec4s>("vec4s");
        type.field<&EveryKind::dvec3s>("dvec3s");
        type.field<&EveryKind::mat3s>("mat3s");
        type.field<&EveryKind::mat4s>("mat4s");
        type.field<&EveryKind::dmat4s>("dmat4s");
        type.field<&EveryKind::ids>("ids");
        type.field<&EveryKind::seasons>("seasons");
        type.field<&EveryKind::nodes>("nodes");
    }
};

}  // namespace umbriel::test
