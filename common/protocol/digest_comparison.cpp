#include "common/protocol/digest_comparison.h"

namespace umbriel::protocol {

using Kind = DigestDifference::Kind;

DigestComparison::DigestComparison(std::shared_ptr<const StateDigest> expected)
    : _expected(std::move(expected)), _containers(_expected->containers()) {}

void DigestComparison::answered(const wire::DigestReply& reply) {
    if (_difference) return;
    if (_field)
        fields(reply);
    else
        page(reply);
}

void DigestComparison::page(const wire::DigestReply& reply) {
    for (const auto& [key, digest] : reply.digests) {
        const ContainerId id{key};
        if (_next == _containers.size() || id < _containers[_next].first) {
            _difference = {Kind::Extra, id, 0};
            return;
        }
        if (_containers[_next].first < id) {
            _difference = {Kind::Missing, _containers[_next].first, 0};
            return;
        }
        if (_containers[_next].second != digest) {
            _container = id;
            _after = {};
            _field = true;
            return;
        }
        ++_next;
        _after = id;
    }
    if (reply.more && !reply.digests.empty()) return;
    if (_next < _containers.size())
        _difference = {Kind::Missing, _containers[_next].first, 0};
    else
        _difference = DigestDifference{};
}

void DigestComparison::fields(const wire::DigestReply& reply) {
    for (const auto& [index, digest] : reply.digests) {
        if (index >= kMaxFields) break;
        if (_expected->ofField(_container, static_cast<std::uint32_t>(index)) == digest) continue;
        _difference = {Kind::Field, _container, static_cast<std::uint32_t>(index)};
        return;
    }
    _difference = {Kind::Container, _container, 0};
}

}  // namespace umbriel::protocol
