#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "common/scene/container.h"
#include "common/scene/element_kind.h"

namespace umbriel {

// Bit i stands for field i of a type.
using FieldMask = std::uint64_t;
inline constexpr std::uint32_t kMaxFields = 64;

// Grants the generic machinery (descriptors, codecs, digests) access to the values inside fields.
struct FieldAccess {
    template <class T>
    static void* valueOf(Single<T>& field) { return &field._value; }
    template <class T>
    static void* valueOf(Multi<T>& field) { return &field._storage; }
};

// One declared field. address() gives a T* for a single field (std::string* for String), a MultiStorage* for a multi.
struct FieldDescriptor {
    std::string_view name;
    ElementKind kind;
    bool isMulti;
    std::uint32_t enumCount;  // for enums: valid values are below this; 0: not an enum
    void* (*address)(Container& container);

    const void* address_(const Container& container) const { return address(const_cast<Container&>(container)); }
    const MultiStorage& multi(const Container& container) const {
        return *static_cast<const MultiStorage*>(address_(container));
    }
    const std::string& text(const Container& container) const {
        return *static_cast<const std::string*>(address_(container));
    }
};

// Its address identifies the C++ type of a container.
template <class T>
inline constexpr char kTypeTag = 0;

// A container type: its name, its fields in the order of their declaration, and how one is made.
struct TypeDescriptor {
    std::string_view name;
    std::uint32_t index = 0;  // position in its registry; what travels on the wire
    bool shipped = true;      // false: stays on the client
    const void* cppType = nullptr;
    std::vector<FieldDescriptor> fields;  // field 0 is always "name"
    std::unique_ptr<Container> (*create)() = nullptr;
    std::unique_ptr<Container> prototype;  // a fresh instance: its values are the defaults
};

template <class T>
class TypeBuilder {
   public:
    explicit TypeBuilder(TypeDescriptor& descriptor) : _descriptor(descriptor) {}

    // Declares a Single or Multi member. The order of declaration is part of the type's signature.
    template <auto Member>
    void field(std::string_view name) {
        using Field = std::remove_reference_t<decltype(std::declval<T&>().*Member)>;
        using Element = typename Field::Element;
        constexpr bool kIsMulti = requires(const Field& field) { field.storage(); };
        std::uint32_t enumCount = 0;
        if constexpr (std::is_enum_v<Element>) enumCount = kEnumCount<Element>;
        _descriptor.fields.push_back({name, elementKindOf<Element>(), kIsMulti, enumCount, [](Container& container) {
                                          return FieldAccess::valueOf(static_cast<T&>(container).*Member);
                                      }});
    }

   private:
    TypeDescriptor& _descriptor;
};

// The types a program knows, in a fixed order. main() fills one (registerCoreTypes in cores.h, tests add their own) and
// passes it down; it must outlive every aspect.
class TypeRegistry {
   public:
    template <class T>
    const TypeDescriptor& add() {
        auto descriptor = std::make_unique<TypeDescriptor>();
        descriptor->name = T::kTypeName;
        descriptor->cppType = &kTypeTag<T>;
        descriptor->create = []() -> std::unique_ptr<Container> { return std::make_unique<T>(); };
        if constexpr (requires { T::kShipped; }) descriptor->shipped = T::kShipped;
        TypeBuilder<T> builder(*descriptor);
        builder.template field<&T::name>("name");
        T::declare(builder);
        return add(std::move(descriptor));
    }

    template <class T>
    const TypeDescriptor& of() const { return byTag(&kTypeTag<T>); }

    std::size_t size() const { return _types.size(); }
    // Null when there is no such type.
    const TypeDescriptor* at(std::uint32_t index) const;
    const TypeDescriptor* byName(std::string_view name) const;
    // A hash of all names, kinds and their order: client and server must agree on it (protocol.md, Hello).
    std::uint64_t signature() const;

   private:
    const TypeDescriptor& add(std::unique_ptr<TypeDescriptor> descriptor);
    const TypeDescriptor& byTag(const void* tag) const;

    std::vector<std::unique_ptr<TypeDescriptor>> _types;
};

// True when the container is of the declared type T; of Container itself everything is.
template <class T>
bool isA(const Container& container) {
    if constexpr (std::is_same_v<T, Container>) return true;
    else return container.type().cppType == &kTypeTag<T>;
}

}  // namespace umbriel
