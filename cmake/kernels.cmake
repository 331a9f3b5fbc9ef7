# Vector kernels: loops that are compiled once for each instruction set, and chosen when the program runs.

# bki_mapping_kernels(ROOM FILE [header...]): compiles src/ROOM/FILE_inl.h for each instruction set, and defines the function that
# FILE.h declares, which chooses among them. FILE_inl.h ends with the table of its loops: for state_kernels the constant
# kStateKernels of type StateKernels, which stateKernelsFor() returns. The headers are those that the loops need compiled for any
# processor.
function(bki_mapping_kernels room file)
  get_filename_component(name ${file} NAME)
  string(REPLACE "_kernels" "Kernels" function ${name})  # stateKernels
  bki_mapping_capitalise(${function} type)               # StateKernels
  set(header ${room}/${file})
  set(needed "")
  foreach(each ${ARGN})
    string(APPEND needed "#include \"${each}\"\n")
  endforeach()
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/kernels)
  configure_file(cmake/kernels_choice.cpp.in ${folder}/${name}.cpp @ONLY)
  set(sources "")
  foreach(set generic avx2 avx512)
    bki_mapping_capitalise(${set} suffix)
    set(end "")
    if(NOT set STREQUAL "generic")
      set(end "#include \"simd/end_region.h\"\n")
    endif()
    configure_file(cmake/kernels_of_set.cpp.in ${folder}/${name}_${set}.cpp @ONLY)
    list(APPEND sources ${folder}/${name}_${set}.cpp)
  endforeach()
  # In them the same names stand for other instruction sets.
  set_source_files_properties(${sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  target_sources(bki_mapping_${room} PRIVATE ${folder}/${name}.cpp ${sources})
endfunction()

function(bki_mapping_capitalise word result)
  string(SUBSTRING ${word} 0 1 first)
  string(SUBSTRING ${word} 1 -1 rest)
  string(TOUPPER ${first} first)
  set(${result} ${first}${rest} PARENT_SCOPE)
endfunction()
