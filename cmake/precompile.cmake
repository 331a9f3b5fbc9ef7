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

# Compiles several files as one, which reads their headers once.
option(BKI_MAPPING_JOIN "Make the first build fast, and later ones slower: join files, and the unit tests of a room" OFF)
function(bki_mapping_join)
  if(BKI_MAPPING_JOIN)
    set_target_properties(${ARGN} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 14)
  endif()
endfunction()

# The same as bki_mapping_precompile(TARGET header...), for a target that joined consists of one or two files: they read the headers
# in less time than it takes to precompile them.
function(bki_mapping_precompile_files target)
  if(NOT BKI_MAPPING_JOIN)
    bki_mapping_precompile(${target} ${ARGN})
  endif()
endfunction()

# Compiles targets in which no scan is computed with -Og, which takes four fifths of the time of -O1, and with the address
# sanitizer two thirds. They may use precompiled headers only of each other. Programs then take more processor time than with -O3:
# export_map half more, simulate_drive several times as much, so that tests without sanitizers take longer than is saved. Mapping
# takes as long as before.
option(BKI_MAPPING_LIGHT "Make the build fast: optimise less where no scan is computed" OFF)
function(bki_mapping_light)
  if(BKI_MAPPING_LIGHT)
    foreach(target ${ARGN})
      target_compile_options(${target} PRIVATE -Og)
    endforeach()
  endif()
endfunction()

# Joined: GCC looks for garbage from 128 MiB of memory on, in vain: it needs at most 2.3 GiB for any file.
if(BKI_MAPPING_JOIN AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options("SHELL:--param ggc-min-heapsize=1048576")
endif()
