# The Python package bki_mapping: python/bki_mapping and, with pybind11, the module _core beside it. With catkin the package
# also holds the generated messages.
find_package(Python3 QUIET COMPONENTS Interpreter Development)
if(BKI_MAPPING_ROS)
  set(BKI_MAPPING_PYTHON_DESTINATION ${CATKIN_PACKAGE_PYTHON_DESTINATION})
  set(BKI_MAPPING_PYTHON_BUILD ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_PYTHON_DESTINATION})
else()
  # Where Debian's Python looks for modules in /usr; in /usr/local, it looks in a folder of its version.
  set(packages lib/python3/dist-packages)
  if(CMAKE_INSTALL_PREFIX STREQUAL "/usr/local" AND Python3_FOUND)
    set(packages lib/python${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}/dist-packages)
  endif()
  set(BKI_MAPPING_PYTHON_PACKAGES ${packages} CACHE STRING "Where Python packages go, below the prefix")
  set(BKI_MAPPING_PYTHON_DESTINATION ${BKI_MAPPING_PYTHON_PACKAGES}/${PROJECT_NAME})
  set(BKI_MAPPING_PYTHON_BUILD ${CMAKE_BINARY_DIR}/python/${PROJECT_NAME})
endif()

set(files python/${PROJECT_NAME}/__init__.py python/${PROJECT_NAME}/__init__.pyi python/${PROJECT_NAME}/py.typed
  python/${PROJECT_NAME}/occupancy_message.py python/${PROJECT_NAME}/ros.py)
foreach(file ${files})
  get_filename_component(name ${file} NAME)
  configure_file(${file} ${BKI_MAPPING_PYTHON_BUILD}/${name} COPYONLY)
endforeach()
install(FILES ${files} DESTINATION ${BKI_MAPPING_PYTHON_DESTINATION})
# Maps of cities: Python alone, and programs of this package.
set(files)
foreach(name __init__ build description plan report work)
  list(APPEND files python/${PROJECT_NAME}/city/${name}.py)
  configure_file(python/${PROJECT_NAME}/city/${name}.py ${BKI_MAPPING_PYTHON_BUILD}/city/${name}.py COPYONLY)
endforeach()
install(FILES ${files} DESTINATION ${BKI_MAPPING_PYTHON_DESTINATION}/city)
if(BKI_MAPPING_ROS)
  catkin_install_python(PROGRAMS scripts/map_city DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  install(PROGRAMS scripts/map_city.sbatch DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
else()
  install(PROGRAMS scripts/map_city scripts/map_city.sbatch DESTINATION bin)
endif()

if(CMAKE_CROSSCOMPILING)
  message(STATUS "The Python module is left out of builds for another processor")
  return()
endif()
# Some package may have looked for Python without its headers. Newer versions of pybind11 (Debian 13) take it for found then, and
# call python_add_library, which only the headers bring.
if(Python_FOUND AND NOT COMMAND python_add_library)
  find_package(Python QUIET COMPONENTS Interpreter Development)
endif()
find_package(pybind11 2.4 QUIET)
if(NOT pybind11_FOUND OR NOT Python3_FOUND)
  message(STATUS "The Python module is left out; install pybind11-dev and python3-dev for it")
  return()
endif()
pybind11_add_module(bki_mapping_python MODULE NO_EXTRAS
  python/arrays.cpp python/city_bindings.cpp python/class_bindings.cpp python/distance_bindings.cpp python/journal_bindings.cpp
  python/map_bindings.cpp
  python/mapper_bindings.cpp python/module.cpp python/point_bindings.cpp python/query_bindings.cpp)
#catkin_lint: ignore_once undefined_target
target_link_libraries(bki_mapping_python PRIVATE bki_mapping_city bki_mapping_export bki_mapping_journal)
target_compile_options(bki_mapping_python PRIVATE -O1)  # the work is done in the libraries
bki_mapping_warnings(bki_mapping_python)
bki_mapping_join(bki_mapping_python)
bki_mapping_light(bki_mapping_python)
bki_mapping_precompile_files(bki_mapping_python
  <Eigen/Geometry> <map> <memory> <pybind11/numpy.h> <pybind11/pybind11.h> <pybind11/stl.h> <string> <vector>)
file(RELATIVE_PATH to_libraries /prefix/${BKI_MAPPING_PYTHON_DESTINATION} /prefix/${BKI_MAPPING_LIB_DESTINATION})
set_target_properties(bki_mapping_python PROPERTIES OUTPUT_NAME _core CXX_VISIBILITY_PRESET hidden
  LIBRARY_OUTPUT_DIRECTORY ${BKI_MAPPING_PYTHON_BUILD} INSTALL_RPATH "$ORIGIN/${to_libraries}")
#catkin_lint: ignore_once undefined_target
install(TARGETS bki_mapping_python LIBRARY DESTINATION ${BKI_MAPPING_PYTHON_DESTINATION})
