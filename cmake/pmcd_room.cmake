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
    # Sources read as one see each other's names; the release build does look at this.
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

# Headers, read again for each source, were a third of a build's time. Off in the preset `dev`, where one source is edited.
option(PMCD_UNITY "compile a few sources of a program or test at a time" ON)

# pmcd_few_at_a_time(<target>): its sources. Not all: a long last object leaves the other cores without work. Not for the
# libraries that others link, where each source is to stand by itself.
function(pmcd_few_at_a_time target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${PMCD_UNITY} UNITY_BUILD_BATCH_SIZE 5)
  if(PMCD_UNITY)
    # g++ takes the sources for headers then, and warns of their anonymous namespaces.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
endfunction()

# pmcd_not_hot(<target>): a sanitizer's checks take longer to optimise than to run, and no fuzzer is guided by it.
function(pmcd_not_hot target)
  if(PMCD_SANITIZE)
    target_compile_options(${target} PRIVATE -O0)
  endif()
  if(PMCD_FUZZ)
    target_compile_options(${target} PRIVATE -fno-sanitize=fuzzer-no-link)
  endif()
endfunction()

# pmcd_program(<target>): a program, or the library of one, of which nothing runs for long in a build with sanitizers.
function(pmcd_program target)
  pmcd_room(${target})
  if(NOT CMAKE_UNITY_BUILD) # which says by itself how many
    pmcd_few_at_a_time(${target})
  endif()
  pmcd_not_hot(${target})
endfunction()

# pmcd_asio(<target>): Boost 1.74's Asio with C++20 coroutines, under gcc and clang alike.
function(pmcd_asio target)
  target_compile_definitions(${target} PUBLIC BOOST_ASIO_NO_DEPRECATED BOOST_ASIO_HAS_CO_AWAIT
                                              BOOST_ASIO_HAS_STD_COROUTINE)
  # g++ 12 inlines the two halves of a coroutine frame's own new and delete unevenly, and then takes them for a mismatch.
  target_compile_options(${target} PUBLIC $<$<CXX_COMPILER_ID:GNU>:-Wno-mismatched-new-delete>)
endfunction()
