# catkin, pybind11 and pluginlib look for Python each in their own way; ROS's modules belong to the system's.
set(PYTHON_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Python for catkin and pybind11")
set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Python for pluginlib")
if(BKI_MAPPING_ROS AND NOT CATKIN_DEVEL_PREFIX)
  # Otherwise catkin takes down an empty PYTHONPATH on the first configure, and tests see that.
  file(MAKE_DIRECTORY "${CMAKE_BINARY_DIR}/devel/lib/python3/dist-packages" "${CMAKE_BINARY_DIR}/devel/lib/pkgconfig")
endif()
