#include "client/session/state_difference.h"

#include <fmt/format.h>

namespace umbriel {
namespace {

std::string nameOf(const Aspect& scene, ContainerId id) {
    const Container* container = scene.find(id);
    if (!container) return fmt::format("#{}", id.value);
    return fmt::format("{} #{} '{}'", container->type().name, id.value, container->name.get());
}

}  // namespace

std::string stateDifferenceText(const protocol::DigestDifference& difference, const Aspect* scene) {
    using Kind = protocol::DigestDifference::Kind;
    const ContainerId id = difference.container;
    const std::string container = scene ? nameOf(*scene, id) : fmt::format("#{}", id.value);
    const Container* found = scene ? scene->find(id) : nullptr;
    switch (difference.kind) {
        case Kind::Field:
            if (found && difference.field < found->type().fields.size())
                return fmt::format(" in container {}, field '{}'", container,
                                   found->type().fields[difference.field].name);
            return fmt::format(" in container {}, field {}", container, difference.field);
        case Kind::Container:
            return fmt::format(" in container {}", container);
        case Kind::Missing:
            return fmt::format(": it lacks container {}", container);
        case Kind::Extra:
            return fmt::format(": it has a container #{} that the client has not", id.value);
        case Kind::None:
            break;
    }
    return ", yet every container is equal: its digest is wrong";
}

}  // namespace umbriel
