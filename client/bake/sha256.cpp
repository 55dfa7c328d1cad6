#include "client/bake/sha256.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>

#include "common/base/assert.h"

namespace umbriel {

struct Sha256::State {
    EVP_MD_CTX* context = EVP_MD_CTX_new();
    ~State() { EVP_MD_CTX_free(context); }
};

Sha256::Sha256() : _state(std::make_unique<State>()) {
    UMBRIEL_ASSERT(EVP_DigestInit_ex(_state->context, EVP_sha256(), nullptr) == 1, "OpenSSL has SHA-256");
}
Sha256::~Sha256() = default;

void Sha256::add(std::span<const std::byte> bytes) {
    UMBRIEL_ASSERT(EVP_DigestUpdate(_state->context, bytes.data(), bytes.size()) == 1, "hashing cannot fail");
}

std::string Sha256::finish() {
    std::array<unsigned char, 32> digest;
    UMBRIEL_ASSERT(EVP_DigestFinal_ex(_state->context, digest.data(), nullptr) == 1, "hashing cannot fail");
    std::string text;
    for (const unsigned char byte : digest) text += fmt::format("{:02x}", byte);
    return text;
}

}  // namespace umbriel
