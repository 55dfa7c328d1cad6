#pragma once

#include <string>

#include "common/scene/container_id.h"
#include "common/scene/multi_field.h"

namespace umbriel {

struct TypeDescriptor;

// Texts in fields are for people (names, captions), so a file with a longer one is not refused: what is beyond is cut
// off when it is set, and decoders refuse it.
inline constexpr std::size_t kMaxTextBytes = 64 * 1024;
// Cuts a text to kMaxTextBytes, before the UTF-8 character that would cross the limit.
void cutText(std::string& text);

// What everything shared derives from: an id, a type, a name, and fields. A concrete type is a struct with Single and
// Multi members and one static function that declares them; that declaration is all that editing, change tracking,
// transport, digests and printing need:
//
//     struct Fog : Container {
//         static constexpr std::string_view kTypeName = "Fog";
//         Single<float> density{0.01f};
//         Single<glm::vec3> colour;
//         static void declare(TypeBuilder<Fog>& type) {
//             type.field<&Fog::density>("density");
//             type.field<&Fog::colour>("colour");
//         }
//     };
//
// A type with `static constexpr bool kShipped = false;` stays on the client (animation data, for example).
class Container {
 public:
    virtual ~Container() = default;
    Container(const Container&) = delete;
    Container& operator=(const Container&) = delete;

    ContainerId id() const { return _id; }
    const TypeDescriptor& type() const { return *_type; }

    Single<std::string> name;  // for people; need not be unique

 protected:
    Container() = default;

 private:
    friend class Aspect;
    friend class TypeRegistry;
    ContainerId _id;
    const TypeDescriptor* _type = nullptr;
};

}  // namespace umbriel
