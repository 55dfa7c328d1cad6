#include "common/scene/aspect.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "common/scene/field_values.h"

namespace umbriel {

Aspect::Aspect(const TypeRegistry& types, IdSource& ids) : _types(types), _ids(ids) {}

Aspect::~Aspect() {
    UMBRIEL_ASSERT(_openEdits.empty(), "an edit outlives its aspect");
}

void Aspect::destroy(ContainerId id) {
    UMBRIEL_ASSERT(_containers.contains(id), "no such container in this aspect");
    remove(id, true);
}

const Container* Aspect::find(ContainerId id) const {
    const auto found = _containers.find(id);
    return found == _containers.end() ? nullptr : found->second.get();
}

Container* Aspect::findMutable(ContainerId id) {
    const auto found = _containers.find(id);
    return found == _containers.end() ? nullptr : found->second.get();
}

std::vector<ContainerId> Aspect::ids() const {
    std::vector<ContainerId> ids;
    ids.reserve(_containers.size());
    for (const auto& [id, container] : _containers) ids.push_back(id);
    std::sort(ids.begin(), ids.end());
    return ids;
}

ChangeList Aspect::commit() {
    UMBRIEL_ASSERT(_openEdits.empty(), "commit while an edit is open");
    ChangeList list;
    list.created.reserve(_createdAt.size());
    for (const ContainerCreation& creation : _created)
        if (creation.id) list.created.push_back(creation);
    list.changed.reserve(_changed.size());
    for (auto& [id, change] : _changed) list.changed.push_back(std::move(change));
    std::sort(list.changed.begin(), list.changed.end(),
              [](const ContainerChange& a, const ContainerChange& b) { return a.id < b.id; });
    for (ContainerChange& change : list.changed) {
        const Container& container = *find(change.id);
        for (MultiChange& multi : change.multis)
            multi.touched.clampTo(container.type().fields[multi.field].multi(container).size());
    }
    list.destroyed = std::exchange(_destroyed, {});
    list.destroyedTypes = std::exchange(_destroyedTypes, {});
    _created.clear();
    _createdAt.clear();
    _changed.clear();
    _destroyedIds.clear();
    return list;
}

ChangeList Aspect::snapshot() const {
    UMBRIEL_ASSERT(_openEdits.empty(), "snapshot while an edit is open");
    ChangeList list;
    for (const ContainerId id : ids()) {
        const Container& container = *find(id);
        const TypeDescriptor& type = container.type();
        list.created.push_back({id, type.index});
        ContainerChange change{id, 0, {}};
        for (std::uint32_t i = 0; i < type.fields.size(); ++i) {
            if (fieldEquals(type.fields[i], container, *type.prototype)) continue;
            change.fields |= FieldMask{1} << i;
            if (!type.fields[i].isMulti) continue;
            change.multis.push_back({i, {}});
            change.multis.back().touched.add(0, type.fields[i].multi(container).size());
        }
        if (change.fields != 0) list.changed.push_back(std::move(change));
    }
    return list;
}

void Aspect::apply(const ChangeList& changes, const Aspect& source) {
    take(changes, source, false);
}

void Aspect::merge(const ChangeList& changes, const Aspect& source) {
    take(changes, source, true);
}

void Aspect::take(const ChangeList& changes, const Aspect& source, bool recording) {
    UMBRIEL_ASSERT(_openEdits.empty(), "an edit is open while another aspect's changes are taken over");
    UMBRIEL_ASSERT(&source != this, "an aspect cannot take over its own changes");
    for (const ContainerCreation& creation : changes.created) {
        const TypeDescriptor* type = _types.at(creation.type);
        UMBRIEL_ASSERT(type != nullptr, "the two aspects have different type registries");
        const Container* from = source.find(creation.id);
        UMBRIEL_ASSERT(from != nullptr, "a change list is used before its aspect is edited again");
        Container* to = findMutable(creation.id);
        UMBRIEL_ASSERT(!to || &to->type() == type, "one id names two containers");
        if (!to) {
            to = &insert(creation.id, *type);
            _ids.skipPast(creation.id);
            if (_destroyedIds.erase(creation.id) != 0)
                reviveRecorded(*to, *from);
            else if (recording)
                recordCreated(creation.id, *type);
        }
        // A list may create what is here already (a snapshot): then its defaults count as well.
        for (std::uint32_t i = 0; i < type->fields.size(); ++i) copyField(*to, *from, i, recording);
    }
    for (const ContainerChange& change : changes.changed) {
        Container* to = findMutable(change.id);
        const Container* from = source.find(change.id);
        UMBRIEL_ASSERT(from != nullptr, "a change list is used before its aspect is edited again");
        if (!to || to->type().index != from->type().index) continue;
        for (std::uint32_t i = 0; i < to->type().fields.size(); ++i)
            if ((change.fields >> i) & 1) copyField(*to, *from, i, recording);
    }
    for (const ContainerId id : changes.destroyed)
        if (_containers.contains(id)) remove(id, recording);
}

bool Aspect::equals(const Aspect& other) const {
    if (_containers.size() != other._containers.size()) return false;
    for (const auto& [id, container] : _containers) {
        const Container* match = other.find(id);
        if (!match || match->type().name != container->type().name) return false;
        for (const FieldDescriptor& field : container->type().fields)
            if (!fieldEquals(field, *container, *match)) return false;
    }
    return true;
}

ContainerId Aspect::createContainer(const TypeDescriptor& type, std::string name) {
    const ContainerId id = _ids.next();
    Container& container = insert(id, type);
    recordCreated(id, type);
    cutText(name);
    if (!name.empty()) RawEdit(*this).setText(container.id(), 0, name);
    return id;
}

Container& Aspect::insert(ContainerId id, const TypeDescriptor& type) {
    auto container = type.create();
    container->_id = id;
    container->_type = &type;
    const auto [place, isNew] = _containers.emplace(id, std::move(container));
    UMBRIEL_ASSERT(isNew, "a container id was used twice");
    return *place->second;
}

void Aspect::copyField(Container& to, const Container& from, std::uint32_t index, bool recording) {
    const FieldDescriptor& field = to.type().fields[index];
    if (!field.isMulti) {
        if (recording) {
            if (field.kind == ElementKind::String)
                RawEdit(*this).setText(to.id(), index, field.text(from));
            else
                RawEdit(*this).setSingle(to.id(), index, bytesOfSingle(field, from));
        } else if (field.kind == ElementKind::String)
            *static_cast<std::string*>(field.address(to)) = field.text(from);
        else
            std::memcpy(field.address(to), field.address_(from), infoOf(field.kind).size);
        return;
    }
    auto& target = *static_cast<MultiStorage*>(field.address(to));
    const MultiStorage& source = field.multi(from);
    const auto pending = _changed.find(to.id());
    const bool isPending = pending != _changed.end() && ((pending->second.fields >> index) & 1) != 0;
    if ((recording || isPending) && !target.equals(source)) {
        const std::size_t common = std::min(target.size(), source.size());
        recordMulti(to.id(), index, common, source.size() - common);
        const std::size_t step = target.elementsPerChunk();
        for (std::size_t first = 0; first < common; first += step) {
            const std::size_t count = std::min(step, common - first);
            const auto bytes = source.chunk(first / step).first(count * source.elementSize());
            if (!target.sharesChunk(first / step, source) && !target.holds(first, bytes))
                recordMulti(to.id(), index, first, count);
        }
    }
    target = source;
}

void Aspect::reviveRecorded(const Container& container, const Container& from) {
    const auto place = std::find(_destroyed.begin(), _destroyed.end(), container.id());
    _destroyedTypes.erase(_destroyedTypes.begin() + (place - _destroyed.begin()));
    _destroyed.erase(place);
    const auto& fields = container.type().fields;
    for (std::uint32_t i = 0; i < fields.size(); ++i)
        if (fields[i].isMulti)
            recordMulti(container.id(), i, 0, fields[i].multi(from).size());
        else
            record(container.id(), FieldMask{1} << i, {});
}

ContainerChange& Aspect::changeOf(ContainerId id) {
    ContainerChange& change = _changed[id];
    change.id = id;
    return change;
}

void Aspect::record(ContainerId id, FieldMask fields, std::span<const MultiChange> multis) {
    changeOf(id).fields |= fields;
    for (const MultiChange& multi : multis) {
        recordMulti(id, multi.field, 0, 0);
        for (const IndexRange& range : multi.touched.ranges()) recordMulti(id, multi.field, range.first, range.count);
    }
}

void Aspect::recordMulti(ContainerId id, std::uint32_t field, std::size_t first, std::size_t count) {
    ContainerChange& change = changeOf(id);
    change.fields |= FieldMask{1} << field;
    auto place = std::lower_bound(change.multis.begin(), change.multis.end(), field,
                                  [](const MultiChange& multi, std::uint32_t value) { return multi.field < value; });
    if (place == change.multis.end() || place->field != field) place = change.multis.insert(place, {field, {}});
    place->touched.add(first, count);
}

void Aspect::recordCreated(ContainerId id, const TypeDescriptor& type) {
    _createdAt.emplace(id, _created.size());
    _created.push_back({id, type.index});
}

void Aspect::remove(ContainerId id, bool recording) {
    const auto found = _containers.find(id);
    UMBRIEL_ASSERT(std::find(_openEdits.begin(), _openEdits.end(), found->second.get()) == _openEdits.end(),
                   "a container is destroyed while it is edited");
    const std::uint32_t type = found->second->type().index;
    _containers.erase(found);
    _changed.erase(id);
    if (const auto created = _createdAt.find(id); created != _createdAt.end()) {
        _created[created->second].id = {};
        _createdAt.erase(created);
    } else if (recording) {
        _destroyed.push_back(id);
        _destroyedTypes.push_back(type);
        _destroyedIds.insert(id);
    }
}

void Aspect::closeEdit(const Container& container) {
    // Nearly always the last one; edits that were moved out of their scope's order are found all the same.
    const auto found = std::find(_openEdits.rbegin(), _openEdits.rend(), &container);
    UMBRIEL_ASSERT(found != _openEdits.rend(), "an edit was closed twice");
    _openEdits.erase(std::next(found).base());
}

bool RawEdit::create(ContainerId id, const TypeDescriptor& type) {
    // Ids are never reused: within one list, creations are applied before destructions.
    if (!id || _aspect._containers.contains(id) || _aspect._destroyedIds.contains(id)) return false;
    UMBRIEL_ASSERT(_aspect._types.at(type.index) == &type, "a type of another registry");
    _aspect.insert(id, type);
    _aspect.recordCreated(id, type);
    _aspect._ids.skipPast(id);
    return true;
}

bool RawEdit::destroy(ContainerId id) {
    if (!_aspect._containers.contains(id)) return false;
    _aspect.remove(id, true);
    return true;
}

void RawEdit::setSingle(ContainerId id, std::uint32_t index, std::span<const std::byte> bytes) {
    Container* container = _aspect.findMutable(id);
    UMBRIEL_ASSERT(container != nullptr, "no such container in this aspect");
    const FieldDescriptor& field = container->type().fields[index];
    UMBRIEL_ASSERT(!field.isMulti && field.kind != ElementKind::String, "not a single field of fixed size");
    UMBRIEL_ASSERT(bytes.size() == infoOf(field.kind).size, "exactly one element");
    void* value = field.address(*container);
    if (std::memcmp(value, bytes.data(), bytes.size()) == 0) return;
    std::memcpy(value, bytes.data(), bytes.size());
    _aspect.record(id, FieldMask{1} << index, {});
}

void RawEdit::setText(ContainerId id, std::uint32_t index, std::string_view text) {
    Container* container = _aspect.findMutable(id);
    UMBRIEL_ASSERT(container != nullptr, "no such container in this aspect");
    const FieldDescriptor& field = container->type().fields[index];
    UMBRIEL_ASSERT(!field.isMulti && field.kind == ElementKind::String, "not a text field");
    UMBRIEL_ASSERT(text.size() <= kMaxTextBytes, "a text is too long");
    auto& value = *static_cast<std::string*>(field.address(*container));
    if (value == text) return;
    value = text;
    _aspect.record(id, FieldMask{1} << index, {});
}

namespace {

MultiStorage& multiOf(Container* container, std::uint32_t index) {
    UMBRIEL_ASSERT(container != nullptr, "no such container in this aspect");
    const FieldDescriptor& field = container->type().fields[index];
    UMBRIEL_ASSERT(field.isMulti, "not a multi field");
    return *static_cast<MultiStorage*>(field.address(*container));
}

}  // namespace

void RawEdit::resizeMulti(ContainerId id, std::uint32_t field, std::size_t size) {
    MultiStorage& storage = multiOf(_aspect.findMutable(id), field);
    const std::size_t before = storage.size();
    if (size == before) return;
    storage.resize(size);
    _aspect.recordMulti(id, field, before, size > before ? size - before : 0);
}

void RawEdit::writeMulti(ContainerId id, std::uint32_t field, std::size_t first, std::span<const std::byte> bytes) {
    MultiStorage& storage = multiOf(_aspect.findMutable(id), field);
    if (storage.holds(first, bytes)) return;
    storage.write(first, bytes);
    _aspect.recordMulti(id, field, first, bytes.size() / storage.elementSize());
}

void RawEdit::assignMulti(ContainerId id, std::uint32_t field, const MultiStorage& source) {
    MultiStorage& storage = multiOf(_aspect.findMutable(id), field);
    UMBRIEL_ASSERT(storage.elementSize() == source.elementSize(), "elements of another size");
    if (storage.equals(source)) return;
    storage = source;
    _aspect.recordMulti(id, field, 0, source.size());
}

}  // namespace umbriel
