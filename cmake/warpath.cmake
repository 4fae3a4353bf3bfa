find_package(Threads REQUIRED)
find_package(Imath REQUIRED)
find_package(TBB REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
# Debian's OpenImageIO lists the headers of OpenCV, which it needs for itself alone and which need not be installed.
find_package(OpenImageIO REQUIRED GLOBAL)
get_target_property(openimageio_includes OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
list(FILTER openimageio_includes EXCLUDE REGEX opencv)
set_target_properties(OpenImageIO::OpenImageIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${openimageio_includes}")

# What every target compiles with: AVX2 at least, and no fast-math, because NaN and infinity must be seen and counted.
add_library(warpath_flags INTERFACE)
# GCC 12 warns of overlaps and overflows that inlined std::string and std::vector code cannot have (GCC bugs 105651, 105762).
target_compile_options(warpath_flags INTERFACE -march=x86-64-v3 -Wall -Wextra -fno-math-errno -fno-trapping-math
                                               -Wno-restrict -Wno-stringop-overflow)

# warpath_folder(NAME [folders and libraries it may use]...)
# Makes the library warpath_NAME of the sources in the current folder (but not main.cpp), and NAME_test of the tests beside them.
function(warpath_folder NAME)
  file(GLOB sources CONFIGURE_DEPENDS *.cpp)
  file(GLOB tests CONFIGURE_DEPENDS *_test.cpp)
  list(REMOVE_ITEM sources ${tests} ${CMAKE_CURRENT_SOURCE_DIR}/main.cpp "")
  add_library(warpath_${NAME} STATIC ${sources})
  target_include_directories(warpath_${NAME} PUBLIC ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(warpath_${NAME} PUBLIC warpath_flags ${ARGN})
  if(WARPATH_TESTS AND tests)
    warpath_test(${NAME}_test ${tests})
    target_link_libraries(${NAME}_test PRIVATE warpath_${NAME})
  endif()
endfunction()

# warpath_test(NAME SOURCES...): a GoogleTest binary, one ctest entry for each of its tests.
function(warpath_test NAME)
  find_package(GTest REQUIRED)
  include(GoogleTest)
  add_executable(${NAME} ${ARGN})
  target_link_libraries(${NAME} PRIVATE warpath_flags GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${NAME} PRIVATE WARPATH_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  gtest_discover_tests(${NAME} DISCOVERY_TIMEOUT 120 PROPERTIES TIMEOUT 900)
endfunction()
