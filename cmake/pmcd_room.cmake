# SPDX-License-Identifier: MIT
# What every target of the house has in common: warnings, hardening, sanitizers, the include root.

find_program(PMCD_CCACHE ccache)
if(PMCD_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${PMCD_CCACHE})
endif()

# pmcd_room(<target>): house warnings; the repository root is the include root, so includes read "codec/decoder.h".
function(pmcd_room target)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wconversion -Wshadow)
  if(CMAKE_UNITY_BUILD)
    # Sources read as one see each other's names; the release build, which reads each by itself, does look at this.
    target_compile_options(${target} PRIVATE -Wno-shadow)
  endif()
  if(PMCD_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${PMCD_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    # clang 14 cannot assemble coroutines with this part of `undefined`.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:Clang>:-fno-sanitize=function>)
    # g++ says of each fence in Asio that it is not understood; what it orders is ordered by locks as well.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-tsan>)
    # Its guesses at what is not set are wrong more often with a sanitizer's calls in between.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
    target_link_options(${target} PUBLIC -fsanitize=${PMCD_SANITIZE})
  endif()
  if(PMCD_FUZZ)
    # Coverage that libFuzzer is guided by; only the programs of tests/fuzz link the fuzzer itself.
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
    target_link_options(${target} PUBLIC -fsanitize=fuzzer-no-link)
  endif()
endfunction()

# pmcd_asio(<target>): Boost 1.74's Asio with C++20 coroutines, under gcc and clang alike.
function(pmcd_asio target)
  target_compile_definitions(${target} PUBLIC BOOST_ASIO_NO_DEPRECATED BOOST_ASIO_HAS_CO_AWAIT
                                              BOOST_ASIO_HAS_STD_COROUTINE)
  # g++ 12 inlines the two halves of a coroutine frame's own new and delete unevenly, and then takes them for a mismatch.
  target_compile_options(${target} PUBLIC $<$<CXX_COMPILER_ID:GNU>:-Wno-mismatched-new-delete>)
endfunction()
