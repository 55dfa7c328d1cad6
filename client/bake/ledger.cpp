#include "client/bake/ledger.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <functional>
#include <system_error>

#include "common/base/assert.h"

namespace umbriel {
namespace {

// "umbl" in ASCII: another program's database is not taken for a ledger.
constexpr int kApplicationId = 0x756d626c;
constexpr int kVersion = 1;

struct Statement {
    sqlite3_stmt* handle = nullptr;
    ~Statement() { sqlite3_finalize(handle); }
};

}  // namespace

struct Ledger::Database {
    std::filesystem::path file;
    std::filesystem::path output;
    sqlite3* handle = nullptr;
    std::vector<Shard> shards;

    ~Database() { sqlite3_close(handle); }

    Error error(int code) const {
        const std::string what = handle != nullptr ? sqlite3_errmsg(handle) : sqlite3_errstr(code);
        switch (code & 0xff) {
            case SQLITE_BUSY:
            case SQLITE_LOCKED:
                return badInput(fmt::format("{}: another bake is writing it; wait for it, or stop it and --resume",
                                            output.string()));
            case SQLITE_NOTADB:
            case SQLITE_CORRUPT:
                return badInput(fmt::format("{}: no ledger of a bake, or damaged ({}); remove it to start anew",
                                            file.string(), what));
            case SQLITE_FULL:
                return failure(fmt::format("{}: the disk is full; make room and --resume", file.string()));
            default:
                return failure(fmt::format("{}: {}", file.string(), what));
        }
    }

    using Bind = std::function<void(sqlite3_stmt*)>;
    using Row = std::function<void(sqlite3_stmt*)>;
    Result<void> run(const char* sql, const Bind& bind = {}, const Row& row = {}) const {
        Statement statement;
        int code = sqlite3_prepare_v2(handle, sql, -1, &statement.handle, nullptr);
        if (code != SQLITE_OK) return error(code);
        if (bind) bind(statement.handle);
        while ((code = sqlite3_step(statement.handle)) == SQLITE_ROW) {
            if (row) row(statement.handle);
        }
        if (code != SQLITE_DONE) return error(code);
        return {};
    }

    Result<void> runAll(std::initializer_list<const char*> statements) const {
        for (const char* sql : statements) {
            if (const auto done = run(sql); !done) return done.error();
        }
        return {};
    }

    Result<int> number(const char* sql) const {
        int value = 0;
        const auto done = run(sql, {}, [&](sqlite3_stmt* row) { value = sqlite3_column_int(row, 0); });
        if (!done) return done.error();
        return value;
    }

    Result<void> create(const Settings& settings, const std::vector<Shard>& planned) {
        const std::string mark = fmt::format("PRAGMA application_id = {}", kApplicationId);
        const std::string version = fmt::format("PRAGMA user_version = {}", kVersion);
        if (const auto made =
                runAll({mark.c_str(), version.c_str(),
                        "CREATE TABLE settings(place INTEGER PRIMARY KEY, name TEXT NOT NULL, value TEXT NOT NULL)",
                        "CREATE TABLE shards(number INTEGER PRIMARY KEY, first_block INTEGER NOT NULL, "
                        "block_count INTEGER NOT NULL, state INTEGER NOT NULL, leases INTEGER NOT NULL)"});
            !made) {
            return made.error();
        }
        for (const auto& [name, value] : settings) {
            const auto added = run("INSERT INTO settings(name, value) VALUES(?, ?)", [&](sqlite3_stmt* s) {
                sqlite3_bind_text(s, 1, name.c_str(), -1, SQLITE_STATIC);
                sqlite3_bind_text(s, 2, value.c_str(), -1, SQLITE_STATIC);
            });
            if (!added) return added.error();
        }
        for (std::size_t i = 0; i < planned.size(); ++i) {
            const auto added = run("INSERT INTO shards VALUES(?, ?, ?, 0, 0)", [&](sqlite3_stmt* s) {
                sqlite3_bind_int64(s, 1, static_cast<sqlite3_int64>(i));
                sqlite3_bind_int64(s, 2, planned[i].firstBlock);
                sqlite3_bind_int64(s, 3, planned[i].blockCount);
            });
            if (!added) return added.error();
        }
        shards = planned;
        return {};
    }

    Result<void> load(const Settings& settings, const std::vector<Shard>& planned, const InWords& inWords) {
        Settings known;
        const auto text = [](sqlite3_stmt* row, int column) {
            const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
            return std::string(bytes != nullptr ? bytes : "");
        };
        if (const auto read = run("SELECT name, value FROM settings ORDER BY place", {},
                                  [&](sqlite3_stmt* row) { known.emplace_back(text(row, 0), text(row, 1)); });
            !read) {
            return read.error();
        }
        for (std::size_t i = 0; i < std::max(known.size(), settings.size()); ++i) {
            const auto of = [i](const Settings& s) {
                return i < s.size() ? s[i] : std::pair<std::string, std::string>{};
            };
            const auto was = of(known), is = of(settings);
            if (was == is) continue;
            const std::string& name = was.first.empty() ? is.first : was.first;
            const auto words = [&](const std::string& value) { return inWords ? inWords(name, value) : value; };
            return badInput(
                fmt::format("{} is the ledger of another bake: its {} is \"{}\", now it is \"{}\"; bake as "
                            "before, into another file, or remove the ledger",
                            file.string(), name, words(was.second), words(is.second)));
        }
        const auto read = run("SELECT first_block, block_count, state, leases FROM shards ORDER BY number", {},
                              [&](sqlite3_stmt* row) {
                                  Shard shard;
                                  shard.firstBlock = static_cast<std::uint32_t>(sqlite3_column_int64(row, 0));
                                  shard.blockCount = static_cast<std::uint32_t>(sqlite3_column_int64(row, 1));
                                  shard.state = static_cast<State>(std::clamp(sqlite3_column_int(row, 2), 0, 2));
                                  shard.leases = static_cast<std::uint32_t>(sqlite3_column_int64(row, 3));
                                  shards.push_back(shard);
                              });
        if (!read) return read.error();
        const bool same = std::ranges::equal(shards, planned, [](const Shard& a, const Shard& b) {
            return a.firstBlock == b.firstBlock && a.blockCount == b.blockCount;
        });
        if (!same)
            return badInput(fmt::format("{}: its shards are not those of its settings; remove it", file.string()));
        return {};
    }
};

Ledger::Ledger(std::unique_ptr<Database> database) : _database(std::move(database)) {}
Ledger::~Ledger() = default;

Result<std::unique_ptr<Ledger>> Ledger::open(const std::filesystem::path& file, const std::filesystem::path& output,
                                             const Settings& settings, const std::vector<Shard>& shards, bool resume,
                                             const InWords& inWords) {
    auto database = std::make_unique<Database>();
    database->file = file;
    database->output = output;
    const int opened = sqlite3_open_v2(file.c_str(), &database->handle,
                                       SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX, nullptr);
    if (opened != SQLITE_OK) return database->error(opened);
    // In exclusive mode the lock of the first transaction stays until the file is closed.
    if (const auto locked =
            database->runAll({"PRAGMA locking_mode = EXCLUSIVE", "PRAGMA synchronous = FULL", "BEGIN EXCLUSIVE"});
        !locked) {
        return locked.error();
    }
    int moved = 0;
    sqlite3_file_control(database->handle, "main", SQLITE_FCNTL_HAS_MOVED, &moved);
    if (moved != 0) return badInput(fmt::format("{}: another bake has just written it", output.string()));
    const auto id = database->number("PRAGMA application_id");
    if (!id) return id.error();
    const auto version = database->number("PRAGMA user_version");
    if (!version) return version.error();
    const auto tables = database->number("SELECT count(*) FROM sqlite_master");
    if (!tables) return tables.error();
    Result<void> ready;
    // A process killed before its first commit leaves an empty file.
    if (*tables == 0) {
        ready = database->create(settings, shards);
    } else if (*id != kApplicationId || *version != kVersion) {
        ready = badInput(fmt::format("{}: no ledger of this version of Umbriel", file.string()));
    } else if (!resume) {
        ready =
            badInput(fmt::format("{}: a bake into this file was not finished; --resume goes on with it, removing {} "
                                 "starts anew",
                                 output.string(), file.parent_path().string()));
    } else {
        ready = database->load(settings, shards, inWords);
    }
    if (!ready) return ready.error();
    if (const auto committed = database->run("COMMIT"); !committed) return committed.error();
    return std::unique_ptr<Ledger>(new Ledger(std::move(database)));
}

std::optional<std::string> Ledger::recorded(const std::filesystem::path& file, const std::string& setting) {
    Database database;
    database.file = file;
    if (sqlite3_open_v2(file.c_str(), &database.handle, SQLITE_OPEN_READWRITE, nullptr) != SQLITE_OK) return {};
    std::optional<std::string> value;
    const auto read = database.run(
        "SELECT value FROM settings WHERE name = ?",
        [&](sqlite3_stmt* s) { sqlite3_bind_text(s, 1, setting.c_str(), -1, SQLITE_STATIC); },
        [&](sqlite3_stmt* row) {
            const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, 0));
            value = text != nullptr ? text : "";
        });
    return read ? value : std::nullopt;
}

const std::vector<Ledger::Shard>& Ledger::shards() const {
    return _database->shards;
}

Result<void> Ledger::set(std::size_t number, State state) {
    UMBRIEL_ASSERT(number < _database->shards.size(), "a shard of the ledger");
    Shard shard = _database->shards[number];
    shard.state = state;
    if (state == State::Leased) ++shard.leases;
    const auto done = _database->run("UPDATE shards SET state = ?, leases = ? WHERE number = ?", [&](sqlite3_stmt* s) {
        sqlite3_bind_int(s, 1, static_cast<int>(shard.state));
        sqlite3_bind_int64(s, 2, shard.leases);
        sqlite3_bind_int64(s, 3, static_cast<sqlite3_int64>(number));
    });
    if (done) _database->shards[number] = shard;
    return done;
}

Result<void> Ledger::remove() {
    std::error_code error;
    // SQLite keeps its journal while it holds the lock exclusively, and a killed bake may have left one. Nothing is
    // open in it now; it goes first, as long as the lock keeps others out.
    for (const char* suffix : {"-journal", "-wal", "-shm"})
        std::filesystem::remove(_database->file.string() + suffix, error);
    std::filesystem::remove(_database->file, error);
    if (error) return failure(fmt::format("{}: {}", _database->file.string(), error.message()));
    return {};
}

}  // namespace umbriel
