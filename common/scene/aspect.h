#pragma once

#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "common/scene/change_list.h"
#include "common/scene/container.h"
#include "common/scene/type_descriptor.h"

namespace umbriel {

template <class T>
class Edit;

namespace detail {
template <class>
struct MemberTraits;
template <class Owner, class FieldType>
struct MemberTraits<FieldType Owner::*> {
    using Element = typename FieldType::Element;
};
// The type of a field's values, from the pointer to the member.
template <auto Member>
using ElementOf = typename MemberTraits<decltype(Member)>::Element;
}  // namespace detail

// One thread's view of the scene: its writes are invisible to other aspects until its change list is applied to them.
// An aspect belongs to one thread at a time; nothing in it locks. Multi fields share chunks between aspects, so
// applying a list costs what changed, never the size of the scene.
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
    // The container must exist and have no open edit. References to it that remain elsewhere then resolve to nothing.
    void destroy(ContainerId id);

    // Null when there is no such container, or it is of another type.
    const Container* find(ContainerId id) const;
    template <class T>
    const T* find(Ref<T> ref) const {
        return findAs<T>(ref.id);
    }
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
    Edit<T> edit(Ref<T> ref) {
        return Edit<T>(*this, const_cast<T&>(get(ref)));
    }

    std::size_t containerCount() const { return _containers.size(); }
    // Every id, ascending.
    std::vector<ContainerId> ids() const;

    // Takes what was edited since the last commit. No edit may be open.
    ChangeList commit();
    // The whole aspect as one list: every container created, every field that differs from its default changed. No edit
    // may be open; what is not committed yet is in it, too.
    ChangeList snapshot() const;
    // Brings this aspect to the state of source for everything the list names: the applied list wins, field by field
    // (of a multi field the whole field, not only the touched ranges). Unknown ids in changes and destructions are
    // skipped (this aspect destroyed them). What is applied counts as committed here: it is not in this aspect's next
    // list. A field that is both applied and edited here without having been committed takes the applied value and
    // stays recorded, so that this aspect's next list carries the value that won. No edit may be open.
    void apply(const ChangeList& changes, const Aspect& source);
    // As apply, but recorded as if it had been edited here, so that this aspect's next list carries it on: how a
    // loader's aspect gets into the one that is shipped. Of multi fields it records all that differs between the two
    // aspects, so receivers of this aspect's lists agree with it whatever each side had edited before.
    void merge(const ChangeList& changes, const Aspect& source);

    // Same ids, types and field values, bit for bit.
    bool equals(const Aspect& other) const;

 private:
    template <class>
    friend class Edit;
    friend class RawEdit;

    ContainerId createContainer(const TypeDescriptor& type, std::string name);
    Container& insert(ContainerId id, const TypeDescriptor& type);
    Container* findMutable(ContainerId id);
    // Sets one field to the source's value; with recording, or where an edit is recorded already, as an edit.
    void copyField(Container& to, const Container& from, std::uint32_t field, bool recording);
    void take(const ChangeList& changes, const Aspect& source, bool recording);
    ContainerChange& changeOf(ContainerId id);
    void record(ContainerId id, FieldMask fields, std::span<const MultiChange> multis);
    void recordMulti(ContainerId id, std::uint32_t field, std::size_t first, std::size_t count);
    void recordCreated(ContainerId id, const TypeDescriptor& type);
    // The applied list brings back what this aspect had destroyed without committing it: instead of the destruction,
    // its next list carries the whole container.
    void reviveRecorded(const Container& container, const Container& from);
    // Forgets the container with all that is recorded of it.
    void remove(ContainerId id, bool recording);
    void closeEdit(const Container& container);

    const TypeRegistry& _types;
    IdSource& _ids;
    std::unordered_map<ContainerId, std::unique_ptr<Container>> _containers;
    std::vector<const Container*> _openEdits;  // one entry per Edit in scope

    std::vector<ContainerCreation> _created;  // id 0: destroyed again
    std::unordered_map<ContainerId, std::size_t> _createdAt;
    std::unordered_map<ContainerId, ContainerChange> _changed;
    std::vector<ContainerId> _destroyed;
    std::vector<std::uint32_t> _destroyedTypes;
    std::unordered_set<ContainerId> _destroyedIds;
};

// The only way to change a container. Lives on the stack; what it changed is recorded when it goes out of scope.
// Setting a field to the value it has is no change.
template <class T>
class Edit {
 public:
    Edit(Aspect& aspect, T& container) : _aspect(aspect), _container(container) {
        aspect._openEdits.push_back(&container);
    }
    ~Edit() {
        if (_fields != 0) _aspect.record(base().id(), _fields, _multis);
        _aspect.closeEdit(_container);
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

    // Single fields. Braces work: set<&Transform::translation>({1.0, 2.0, 3.0}). Texts are cut to kMaxTextBytes.
    template <auto Member, class Value = detail::ElementOf<Member>>
    Edit& set(Value&& value) {
        auto& field = _container.*Member;
        detail::ElementOf<Member> converted(std::forward<Value>(value));
        if constexpr (std::is_same_v<detail::ElementOf<Member>, std::string>) cutText(converted);
        if (!bitEqual(field._value, converted)) {
            touch(indexOf<Member>());
            field._value = std::move(converted);
        }
        return *this;
    }

    // Multi fields. assign replaces everything, write overwrites from an index on (in one piece, within the size),
    // resize appends zeros or cuts. Ranges are contiguous: vectors, arrays, spans, or braces.
    template <auto Member, class Range = std::initializer_list<detail::ElementOf<Member>>>
    Edit& assign(const Range& values) {
        const std::span<const detail::ElementOf<Member>> span(values);
        resize<Member>(span.size());
        return write<Member>(0, span);
    }
    template <auto Member, class Range = std::initializer_list<detail::ElementOf<Member>>>
    Edit& write(std::size_t first, const Range& values) {
        const std::span<const detail::ElementOf<Member>> span(values);
        MultiStorage& storage = (_container.*Member)._storage;
        if (storage.holds(first, std::as_bytes(span))) return *this;
        touchMulti(indexOf<Member>(), first, span.size());
        storage.write(first, std::as_bytes(span));
        return *this;
    }
    template <auto Member, class Value = detail::ElementOf<Member>>
    Edit& setElement(std::size_t index, const Value& value) {
        const detail::ElementOf<Member> converted(value);
        return write<Member>(index, std::span<const detail::ElementOf<Member>>(&converted, 1));
    }
    template <auto Member, class Value = detail::ElementOf<Member>>
    Edit& append(const Value& value) {
        const detail::ElementOf<Member> converted(value);
        const std::size_t size = (_container.*Member).size();
        resize<Member>(size + 1);
        return setElement<Member>(size, converted);
    }
    template <auto Member>
    Edit& resize(std::size_t size) {
        MultiStorage& storage = (_container.*Member)._storage;
        const std::size_t before = storage.size();
        if (size == before) return *this;
        touchMulti(indexOf<Member>(), before, size > before ? size - before : 0);
        storage.resize(size);
        return *this;
    }

 private:
    // A type may have fields called id or type.
    const Container& base() const { return _container; }
    template <class Value>
    static bool bitEqual(const Value& a, const Value& b) {
        if constexpr (std::is_trivially_copyable_v<Value>)
            return std::memcmp(&a, &b, sizeof(Value)) == 0;
        else
            return a == b;
    }
    // The position of a member among the declared fields.
    template <auto Member>
    std::uint32_t indexOf() const {
        const void* address = FieldAccess::valueOf(_container.*Member);
        const auto& fields = base().type().fields;
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
