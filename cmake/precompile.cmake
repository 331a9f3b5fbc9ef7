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

# Compiles several files as one, which reads their headers once, and optimises those less in which no scan is computed.
option(BKI_MAPPING_JOIN "Make the first build fast: join files, which makes later ones slower, and optimise some less" OFF)
option(BKI_MAPPING_JOIN_TESTS "Join the unit tests of a room, which are then one program, and the files of the lab and of the Python module"
  ${BKI_MAPPING_JOIN})
function(bki_mapping_join_always)
  set_target_properties(${ARGN} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 14)
endfunction()
function(bki_mapping_join)
  if(BKI_MAPPING_JOIN)
    bki_mapping_join_always(${ARGN})
  endif()
endfunction()
# For what is outside of src: the lab and the Python module.
function(bki_mapping_join_with_tests)
  if(BKI_MAPPING_JOIN OR BKI_MAPPING_JOIN_TESTS)
    bki_mapping_join_always(${ARGN})
  endif()
endfunction()

# The same as bki_mapping_precompile(TARGET header...), for a target that joined consists of one or two files: they read the headers
# in less time than it takes to precompile them.
function(bki_mapping_precompile_files target)
  if(NOT BKI_MAPPING_JOIN)
    bki_mapping_precompile(${target} ${ARGN})
  endif()
endfunction()

# Joined, targets in which no scan is computed are compiled with -Og, which takes four fifths of the time of -O1. They may use
# precompiled headers only of each other. export_map then takes half more processor time than with -O3; mapping takes as long as
# before.
function(bki_mapping_light)
  if(BKI_MAPPING_JOIN)
    foreach(target ${ARGN})
      target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-Og>)
    endforeach()
  endif()
endfunction()

# Joined: GCC looks for garbage from 128 MiB of memory on, in vain: it needs at most 1.7 GiB for any file.
if(BKI_MAPPING_JOIN AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options("SHELL:--param ggc-min-heapsize=1048576")
endif()
