# Precompiled headers: reading Eigen, ROS, PCL and GoogleTest takes most of the time of a build. With ccache they would
# only stand in the way.
if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES "ccache")
  set(BKI_MAPPING_PRECOMPILE OFF)
else()
  option(BKI_MAPPING_PRECOMPILE "Precompile the headers that most files read" ON)
endif()

# bki_mapping_precompile(TARGET header...), or bki_mapping_precompile(TARGET REUSE OTHER). GCC then compiles TARGET with OTHER's
# level of optimisation, and leaves the headers unused, with a warning, if OTHER has definitions that TARGET has not.
function(bki_mapping_precompile target)
  if(NOT BKI_MAPPING_PRECOMPILE)
    return()
  endif()
  if(ARGV1 STREQUAL "REUSE")
    target_precompile_headers(${target} REUSE_FROM ${ARGV2})
  else()
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
endfunction()

# Compiles several files as one, which reads their headers once. Not for rooms with vector files, in which the same names stand
# for other instruction sets, and not for those in which scans are computed: their code is inlined as measured.
option(BKI_MAPPING_JOIN "Compile several files as one, optimised less where no scan is computed: faster from scratch, slower after a change" OFF)
option(BKI_MAPPING_JOIN_TESTS "The same for the unit tests of a room, which are then one program" ${BKI_MAPPING_JOIN})
function(bki_mapping_join_always)
  set_target_properties(${ARGN} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 14)
endfunction()
function(bki_mapping_join)
  if(BKI_MAPPING_JOIN)
    bki_mapping_join_always(${ARGN})
  endif()
endfunction()

# Targets in which no scan is computed take half the time with -O1. Their precompiled headers must be theirs, or another such
# target's. Only where files are joined: who has time to wait gets the fastest code.
function(bki_mapping_light)
  if(BKI_MAPPING_JOIN)
    foreach(target ${ARGN})
      target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
    endforeach()
  endif()
endfunction()

# GCC collects garbage from 128 MiB on; all that it needs for the largest file is 1 GiB.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options("SHELL:--param ggc-min-heapsize=1048576")
endif()
