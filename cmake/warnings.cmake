# Strict warnings for this package's own code.
function(bki_mapping_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion)
  if(BKI_MAPPING_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()
