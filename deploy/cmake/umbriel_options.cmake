# Compiler and linker options shared by every target.
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

# Asserts stay on in every build (common/base/assert.h), so NDEBUG only governs third-party headers.
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG")
set(CMAKE_CXX_FLAGS_DEBUG "-O0 -g -DUMBRIEL_DEBUG")
add_compile_options(-Wall -Wextra -ffp-contract=off -fno-math-errno)
add_compile_definitions(UMBRIEL_VERSION="${PROJECT_VERSION}" GLM_FORCE_SILENT_WARNINGS GLM_FORCE_XYZW_ONLY)
if(UMBRIEL_WERROR)
  add_compile_options(-Werror)
endif()

if(UMBRIEL_SANITIZE)
  set(CMAKE_CXX_FLAGS_RELEASE "-O1 -DNDEBUG")  # less to compile; the release preset tests -O2
  string(REPLACE ";" "," _sanitizers "${UMBRIEL_SANITIZE}")
  add_compile_options(-fsanitize=${_sanitizers} -fno-omit-frame-pointer -fno-sanitize-recover=all -g1)
  add_link_options(-fsanitize=${_sanitizers})
endif()
if("thread" IN_LIST UMBRIEL_SANITIZE)
  # The thread sanitizer does not know fences, which Asio uses for executors of several threads; ours have one.
  add_compile_definitions(BOOST_ASIO_DISABLE_FENCED_BLOCK)
endif()
if(UMBRIEL_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)  # every module reports its coverage to the fuzzer
endif()

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  # Paths relative to the clone: every clone and worktree on a machine shares what any of them compiled.
  set(CMAKE_CXX_COMPILER_LAUNCHER env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE_PROGRAM})
endif()
find_program(MOLD_PROGRAM mold)
if(MOLD_PROGRAM AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_link_options(-fuse-ld=mold)
endif()
