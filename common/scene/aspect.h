#pragma once

#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/scene/change_list.h"
#include "common/scene/container.h"
#include "common/scene/type_descriptor.h"

namespace umbriel {

template <class T>
class Edit;

// One thread's view of the scene: its writes are invisible to other aspects until its change list is applied to them.
// An aspect belongs to one thread at a time; nothing in it locks. Multi fields share chunks between aspects, so applying
// a list costs what changed, never the size of the scene.
class Aspect {
   public:
    Aspect(const TypeRegistry& types, IdSource& ids);
    ~Aspect();
    Aspect(const Aspect&) = delete;
    Aspect& operator=(const Aspect&) = delete;

    const TypeRegistry& types() const { return _types; }

    template <class T>
    Ref<T> create(std::string name = {}) {
        return Ref<T>(createContainer(_types.of<T>(), std::move(name)));
    }
    // The container must exist. References to it that remain elsewhere then resolve to nothing.
    void destroy(ContainerId id);

    // Null when there is no such container, or it is of another type.
    const Container* find(ContainerId id) const;
    template <class T>
    const T* find(Ref<T> ref) const { return findAs<T>(ref.id); }
    template <class T>
    const T* findAs(ContainerId id) const {
        const Container* container = find(id);
        return container && isA<T>(*container) ? static_cast<const T*>(container) : nullptr;
    }
    // The container must exist and be a T.
    template <class T>
    const T& get(Ref<T> ref) const {
        const T* found = findAs<T>(ref.id);
        UMBRIEL_ASSERT(found != nullptr, "no such container of this type in this aspect");
        return *found;
    }

    // Opens an edit of the container; leaving its scope records what changed. With fields named, touching any other
    // one is a programming error. Edits nest, also on the same container.
    //     auto edit = aspect.edit(transform);
    //     edit.set<&Transform::translation>({1, 2, 3});
    template <class T>
    Edit<T> edit(Ref<T> ref) { return Edit<T>(*this, const_cast<T&>(get(ref))); }

    std::size_t containerCount() const { return _containers.size(); }
    // Every id, ascending.
    std::vector<ContainerId> ids() const;

    // Takes what was edited since the last commit. No edit may be open.
    ChangeList commit();
    // The whole aspect as one list: every container created, every field that differs from its default changed.
    ChangeList snapshot() const;
    // Brings this aspect to the state of source for everything the list names: the applied list wins. Unknown ids in
    // changes and destructions are skipped (this aspect destroyed them). What is applied counts as committed here.
    void apply(const ChangeList& changes, const Aspect& source);

    // Same ids, types and field values, bit for bit.
    bool equals(const Aspect& other) const;

   private:
    template <class>
    friend class Edit;
    friend class RawEdit;

    ContainerId createContainer(const TypeDescriptor& type, std::string name);
    Container& insert(ContainerId id, const TypeDescriptor& type);
    void record(ContainerId id, FieldMask fields, std::span<const MultiChange> multis);
    void recordCreated(ContainerId id, const TypeDescriptor& type);
    void recordDestroyed(ContainerId id);

    const TypeRegistry& _types;
    IdSource& _ids;
    std::unordered_map<ContainerId, std::unique_ptr<Container>> _containers;
    int _openEdits = 0;

    std::vector<ContainerCreation> _created;
    std::unordered_map<ContainerId, ContainerChange> _changed;
    std::vector<ContainerId> _destroyed;
};

// The only way to change a container. Lives on the stack; what it changed is recorded when it goes out of scope. Setting
// a field to the value it has is no change.
template <class T>
class Edit {
   public:
    Edit(Aspect& aspect, T& container) : _aspect(aspect), _container(container) { ++aspect._openEdits; }
    ~Edit() {
        if (_fields != 0) _aspect.record(_container.id(), _fields, _multis);
        --_aspect._openEdits;
    }
    Edit(const Edit&) = delete;
    Edit& operator=(const Edit&) = delete;

    // Restricts this edit to the given fields: touching another one is a programming error.
    template <auto... Members>
    Edit& only() {
        _allowed = ((FieldMask{1} << indexOf<Members>()) | ... | FieldMask{0});
        return *this;
    }

    const T& read() const { return _container; }

    // Single fields.
    template <auto Member, class Value>
    Edit& set(Value&& value) {
        auto& field = _container.*Member;
        using Element = typename std::remove_reference_t<decltype(field)>::Element;
        Element converted(std::forward<Value>(value));
        if (!bitEqual(field._value, converted)) {
            field._value = std::move(converted);
            touch(indexOf<Member>());
        }
        return *this;
    }

    // Multi fields. assign replaces everything, write overwrites from an index on, resize appends zeros or cuts.
    template <auto Member, class Range>
    Edit& assign(const Range& values) {
        using Element = typename std::remove_reference_t<decltype(_container.*Member)>::Element;
        const std::span<const Element> span(values);
        (_container.*Member)._storage.resize(span.size());
        (_container.*Member)._storage.write(0, std::as_bytes(span));
        touchMulti(indexOf<Member>(), 0, span.size());
        return *this;
    }
    template <auto Member, class Range>
    Edit& write(std::size_t first, const Range& values) {
        using Element = typename std::remove_reference_t<decltype(_container.*Member)>::Element;
        const std::span<const Element> span(values);
        (_container.*Member)._storage.write(first, std::as_bytes(span));
        touchMulti(indexOf<Member>(), first, span.size());
        return *this;
    }
    template <auto Member, class Value>
    Edit& setElement(std::size_t index, const Value& value) {
        using Element = typename std::remove_reference_t<decltype(_container.*Member)>::Element;
        const Element converted(value);
        return write<Member>(index, std::span<const Element>(&converted, 1));
    }
    template <auto Member, class Value>
    Edit& append(const Value& value) {
        const std::size_t size = (_container.*Member).size();
        resize<Member>(size + 1);
        return setElement<Member>(size, value);
    }
    template <auto Member>
    Edit& resize(std::size_t size) {
        const std::size_t before = (_container.*Member).size();
        (_container.*Member)._storage.resize(size);
        touchMulti(indexOf<Member>(), before, size > before ? size - before : 0);
        return *this;
    }

   private:
    template <class Value>
    static bool bitEqual(const Value& a, const Value& b) {
        if constexpr (std::is_trivially_copyable_v<Value>) return std::memcmp(&a, &b, sizeof(Value)) == 0;
        else return a == b;
    }
    // The position of a member among the declared fields.
    template <auto Member>
    std::uint32_t indexOf() const {
        const void* address = FieldAccess::valueOf(_container.*Member);
        const auto& fields = _container.type().fields;
        for (std::uint32_t i = 0; i < fields.size(); ++i)
            if (fields[i].address(_container) == address) return i;
        UMBRIEL_ASSERT(false, "this member was not declared as a field");
        return 0;
    }
    void touch(std::uint32_t field) {
        UMBRIEL_ASSERT((_allowed >> field) & 1, "this edit did not announce the field it touches");
        _fields |= FieldMask{1} << field;
    }
    void touchMulti(std::uint32_t field, std::size_t first, std::size_t count) {
        touch(field);
        for (MultiChange& multi : _multis)
            if (multi.field == field) return multi.touched.add(first, count);
        _multis.push_back({field, {}});
        _multis.back().touched.add(first, count);
    }

    Aspect& _aspect;
    T& _container;
    FieldMask _fields = 0;
    FieldMask _allowed = ~FieldMask{0};
    std::vector<MultiChange> _multis;
};

// Untyped editing for decoders: the same effects and records as Edit, driven by descriptors. The caller has validated
// types, kinds and sizes.
class RawEdit {
   public:
    explicit RawEdit(Aspect& aspect) : _aspect(aspect) {}

    // False when the id exists already (or is 0).
    bool create(ContainerId id, const TypeDescriptor& type);
    // False when there is no such container.
    bool destroy(ContainerId id);
    // bytes: exactly one element of the field's kind.
    void setSingle(ContainerId id, std::uint32_t field, std::span<const std::byte> bytes);
    void setText(ContainerId id, std::uint32_t field, std::string_view text);
    void resizeMulti(ContainerId id, std::uint32_t field, std::size_t size);
    void writeMulti(ContainerId id, std::uint32_t field, std::size_t first, std::span<const std::byte> bytes);
    // Takes over a whole multi field, sharing its chunks.
    void assignMulti(ContainerId id, std::uint32_t field, const MultiStorage& storage);

   private:
    Aspect& _aspect;
};

}  // namespace umbriel
