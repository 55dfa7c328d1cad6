#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace umbriel {

// What a bake has done so far, in an SQLite file that outlives the process: each shard is planned, leased (somebody
// works on it) or done. Every change is on the disk when the call returns. Lives on one thread.
//
// The file is locked for as long as the ledger is open; the lock ends with the process, however that ends.
class Ledger {
 public:
    enum class State { Planned = 0, Leased = 1, Done = 2 };
    struct Shard {
        std::uint32_t firstBlock = 0;
        std::uint32_t blockCount = 0;
        State state = State::Planned;
        std::uint32_t leases = 0;  // how often it was given out
    };
    // What a bake is a function of, by name; a ledger continues only a bake that agrees in all of it.
    using Settings = std::vector<std::pair<std::string, std::string>>;

    // A setting's value as a person knows it, for messages.
    using InWords = std::function<std::string(const std::string& name, const std::string& value)>;

    // Opens or makes it. Bad input: another process has it, it is of another bake (the message names the first setting
    // that differs), it is no ledger; and, unless resume, when it exists. Failure: the disk. `output` names the bake in
    // messages. `shards` are written into a new ledger; an existing one must have the same.
    static Result<std::unique_ptr<Ledger>> open(const std::filesystem::path& file, const std::filesystem::path& output,
                                                const Settings& settings, const std::vector<Shard>& shards,
                                                bool resume, const InWords& inWords = {});
    // What the ledger of an interrupted bake says of one setting; none when there is no ledger, or another process has
    // it: open() says why.
    static std::optional<std::string> recorded(const std::filesystem::path& file, const std::string& setting);
    ~Ledger();
    Ledger(const Ledger&) = delete;
    Ledger& operator=(const Ledger&) = delete;

    // As they are now. Numbers below are indices into this.
    const std::vector<Shard>& shards() const;
    // Leased counts the lease.
    Result<void> set(std::size_t shard, State state);
    // Deletes the file, with the lock held; last call.
    Result<void> remove();

 private:
    struct Database;
    explicit Ledger(std::unique_ptr<Database> database);
    std::unique_ptr<Database> _database;
};

}  // namespace umbriel
