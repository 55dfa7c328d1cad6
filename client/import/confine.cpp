#include "client/import/confine.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define UMBRIEL_SHADOW_MEMORY 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define UMBRIEL_SHADOW_MEMORY 1
#endif
#endif

namespace umbriel {
namespace {

bool limitResource(__rlimit_resource resource, rlim_t soft, rlim_t hard) {
    rlimit now{};
    if (getrlimit(resource, &now) != 0) return false;
    const rlimit wanted{std::min(soft, now.rlim_max), std::min(hard, now.rlim_max)};
    return setrlimit(resource, &wanted) == 0;
}

// Files can be read in the file's folder and below, nowhere else, and none written. Kernels without Landlock leave it
// to SourceFolder.
void confineFiles(const std::string& file) {
    // The rights of Landlock's first version, which every kernel that has it knows.
    constexpr std::uint64_t kAllRights = (std::uint64_t{LANDLOCK_ACCESS_FS_MAKE_SYM} << 1) - 1;
    landlock_ruleset_attr rights{};
    rights.handled_access_fs = kAllRights;
    const long rules = syscall(SYS_landlock_create_ruleset, &rights, sizeof(rights), 0);
    if (rules < 0) return;
    const auto allow = [&](const std::string& path, std::uint64_t access) {
        landlock_path_beneath_attr below{};
        below.allowed_access = access;
        below.parent_fd = open(path.c_str(), O_PATH | O_CLOEXEC);
        if (below.parent_fd < 0) return;
        syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &below, 0);
        close(below.parent_fd);
    };
    const std::size_t slash = file.rfind('/');
    allow(slash == std::string::npos ? "." : file.substr(0, slash + 1),
          LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR);
    allow(file, LANDLOCK_ACCESS_FS_READ_FILE);  // may be a link to elsewhere
    syscall(SYS_landlock_restrict_self, rules, 0);
    close(static_cast<int>(rules));
}

// System calls that reach beyond the process fail with EPERM. Where the processor is none of those listed, the limits
// above have to do.
[[maybe_unused]] void confineCalls() {
#if defined(__x86_64__)
    constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
    constexpr std::uint32_t kFirstForeignCall = 0x40000000;  // the x32 interface
#elif defined(__aarch64__)
    constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
    constexpr std::uint32_t kFirstForeignCall = 0xffffffff;
#else
    return;
#endif
#if defined(__x86_64__) || defined(__aarch64__)
    constexpr std::array<std::uint32_t, 10> kRefused = {
        SYS_socket, SYS_socketpair, SYS_connect,           SYS_execve,        SYS_execveat, SYS_ptrace,
        SYS_kill,   SYS_tgkill,     SYS_process_vm_writev, SYS_io_uring_setup};
    constexpr std::uint32_t kRefusal = SECCOMP_RET_ERRNO | EPERM;
    std::array<sock_filter, 7 + 2 * kRefused.size()> program{};
    std::size_t size = 0;
    program[size++] = BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch));
    program[size++] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kArchitecture, 1, 0);
    program[size++] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS);
    program[size++] = BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr));
    for (const std::uint32_t call : kRefused) {
        program[size++] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 1);
        program[size++] = BPF_STMT(BPF_RET | BPF_K, kRefusal);
    }
    program[size++] = BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, kFirstForeignCall, 0, 1);
    program[size++] = BPF_STMT(BPF_RET | BPF_K, kRefusal);
    program[size++] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    const sock_fprog filter{static_cast<unsigned short>(size), program.data()};
    prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0, 0);
#endif
}

}  // namespace

Result<void> confineProcess(const ImportLimits& limits, const std::string& file, int lastDescriptor) {
    const rlim_t seconds = static_cast<rlim_t>(std::max<std::int64_t>(limits.cpuTime.count(), 1));
    bool limited = limitResource(RLIMIT_CPU, seconds, seconds + 1) && limitResource(RLIMIT_CORE, 0, 0) &&
                   limitResource(RLIMIT_NOFILE, 64, 64);
#ifndef UMBRIEL_SHADOW_MEMORY
    // Sanitizers reserve terabytes of address space for their shadows; builds without them have the limit.
    limited = limited && limitResource(RLIMIT_AS, limits.processBytes, limits.processBytes);
#endif
    if (!limited) return failure("the limits of the import process cannot be set");
    // The client's files, sockets and GPU are none of the importer's business.
    syscall(SYS_close_range, static_cast<unsigned>(lastDescriptor) + 1, ~0u, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0);
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    confineFiles(file);
#ifndef UMBRIEL_SHADOW_MEMORY
    confineCalls();  // sanitizers start helper programs
#endif
    return {};
}

}  // namespace umbriel
