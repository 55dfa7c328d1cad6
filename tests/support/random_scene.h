#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/aspect.h"
#include "common/scene/core_types.h"
#include "tests/support/every_kind.h"

namespace umbriel::test {

// SplitMix64 (Steele et al. 2014): the same numbers on every machine.
class Random {
 public:
    explicit Random(std::uint64_t seed) : _state(seed) {}
    std::uint64_t next() {
        std::uint64_t z = (_state += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    std::size_t below(std::size_t bound) { return bound == 0 ? 0 : next() % bound; }
    std::vector<std::byte> bytes(std::size_t count) {
        std::vector<std::byte> out(count);
        for (std::byte& byte : out) byte = static_cast<std::byte>(next());
        return out;
    }

 private:
    std::uint64_t _state;
};

// Edits an aspect at random: every word is one edit, the same one for the same word and state. Containers of all types
// that are shipped, every kind of field, with texts, sizes and ranges small and large.
class RandomEditor {
 public:
    explicit RandomEditor(Aspect& aspect) : _aspect(aspect) {
        for (std::uint32_t i = 0; aspect.types().at(i); ++i)
            if (aspect.types().at(i)->shipped) _types.push_back(aspect.types().at(i));
    }

    void grow(std::size_t containers, std::uint64_t seed) {
        Random random(seed);
        while (_live.size() < containers) {
            create(random);
            edit(random);
        }
    }

    // One container of every type, with a value in every field.
    void fillAll(std::uint64_t seed) {
        Random random(seed);
        for (const TypeDescriptor* type : _types) {
            const ContainerId id = freshId();
            if (!RawEdit(_aspect).create({id.value}, *type)) continue;
            _live.push_back(id);
            for (std::uint32_t i = 0; i < type->fields.size(); ++i) {
                const FieldDescriptor& field = type->fields[i];
                if (field.isMulti) {
                    RawEdit(_aspect).resizeMulti(id, i, 3);
                    RawEdit(_aspect).writeMulti(id, i, 0, elements(field, 3, random));
                } else if (field.kind == ElementKind::String) {
                    RawEdit(_aspect).setText(id, i, type->name);
                } else {
                    RawEdit(_aspect).setSingle(id, i, elements(field, 1, random));
                }
            }
        }
    }

    void step(std::uint64_t word) {
        Random random(word);
        const std::size_t action = random.below(16);
        if (action == 0)
            create(random);
        else if (action == 1 && !_live.empty())
            destroy(random);
        else if (!_live.empty())
            edit(random);
    }

 private:
    void create(Random& random) {
        // Typed creation and the untyped one must not differ.
        if (random.below(4) == 0) return _live.push_back(_aspect.create<EveryKind>("every").id);
        const ContainerId id = freshId();
        RawEdit(_aspect).create({id.value}, *_types[random.below(_types.size())]) ? _live.push_back(id) : void();
    }

    ContainerId freshId() {
        const ContainerId id = _aspect.create<Node>().id;
        _aspect.destroy(id);
        return id;
    }

    void destroy(Random& random) {
        const std::size_t index = random.below(_live.size());
        _aspect.destroy(_live[index]);
        _live[index] = _live.back();
        _live.pop_back();
    }

    void edit(Random& random) {
        const ContainerId id = _live[random.below(_live.size())];
        const Container& container = *_aspect.find(id);
        if (const auto* every = _aspect.findAs<EveryKind>(id); every && random.below(2) == 0)
            return editTyped(*every, random);
        const auto& fields = container.type().fields;
        for (std::size_t n = 1 + random.below(3); n > 0; --n) {
            const auto index = static_cast<std::uint32_t>(random.below(fields.size()));
            if (fields[index].isMulti)
                editMulti(id, index, fields[index], random);
            else if (fields[index].kind == ElementKind::String)
                RawEdit(_aspect).setText(id, index, std::string(random.below(20), 'x'));
            else
                RawEdit(_aspect).setSingle(id, index, elements(fields[index], 1, random));
        }
    }

    void editMulti(ContainerId id, std::uint32_t index, const FieldDescriptor& field, Random& random) {
        const std::size_t size = field.multi(*_aspect.find(id)).size();
        // Mostly short; now and then more than a chunk, or more than the blob threshold of the test.
        const std::size_t limit = random.below(16) == 0 ? 20'000 / infoOf(field.kind).size : 12;
        switch (random.below(4)) {
            case 0:
                RawEdit(_aspect).resizeMulti(id, index, random.below(limit));
                break;
            case 1: {
                MultiStorage storage(infoOf(field.kind).size);
                storage.resize(random.below(limit));
                storage.write(0, elements(field, storage.size(), random));
                RawEdit(_aspect).assignMulti(id, index, storage);
                break;
            }
            default: {
                if (size == 0) return RawEdit(_aspect).resizeMulti(id, index, 1 + random.below(limit));
                const std::size_t first = random.below(size);
                const std::size_t count = 1 + random.below(std::min<std::size_t>(size - first, 40));
                RawEdit(_aspect).writeMulti(id, index, first, elements(field, count, random));
            }
        }
    }

    void editTyped(const EveryKind& every, Random& random) {
        auto edit = _aspect.edit(Ref<EveryKind>(static_cast<const Container&>(every).id()));
        const float value = static_cast<float>(random.below(1000));
        switch (random.below(8)) {
            case 0:
                edit.set<&EveryKind::flag>(random.below(2) == 0);
                break;
            case 1:
                edit.set<&EveryKind::mat3>(glm::mat3(value)).set<&EveryKind::dvec3>({value, 1.0, 2.0});
                break;
            case 2:
                edit.set<&EveryKind::season>(static_cast<Season>(random.below(4)));
                break;
            case 3:
                edit.append<&EveryKind::vec3s>(glm::vec3(value));
                break;
            case 4:
                edit.assign<&EveryKind::seasons>({Season::Winter, static_cast<Season>(random.below(4))});
                break;
            case 5:
                edit.set<&EveryKind::name>("name " + std::to_string(random.below(10)));
                break;
            case 6:
                edit.resize<&EveryKind::dmat4s>(random.below(300));
                break;
            default:
                if (!every.vec3s.empty())
                    edit.setElement<&EveryKind::vec3s>(random.below(every.vec3s.size()), glm::vec3(value));
        }
    }

    // Random bytes that are valid values.
    static std::vector<std::byte> elements(const FieldDescriptor& field, std::size_t count, Random& random) {
        auto bytes = random.bytes(count * infoOf(field.kind).size);
        if (field.kind == ElementKind::Bool) bytes[0] &= std::byte{1};
        if (field.enumCount != 0)
            for (std::size_t i = 0; i < count; ++i) {
                const auto value = static_cast<std::uint32_t>(random.below(field.enumCount));
                std::memcpy(bytes.data() + i * sizeof(value), &value, sizeof(value));
            }
        return bytes;
    }

    Aspect& _aspect;
    std::vector<const TypeDescriptor*> _types;
    std::vector<ContainerId> _live;
};

}  // namespace umbriel::test
