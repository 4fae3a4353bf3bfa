find_package(Threads REQUIRED)
find_package(Imath REQUIRED)
find_package(TBB REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
if(WARPATH_RENDERER)
  # Debian's OpenImageIO lists the headers of OpenCV, which it needs for itself alone and which need not be installed.
  find_package(OpenImageIO REQUIRED GLOBAL)
  get_target_property(openimageio_includes OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
  list(FILTER openimageio_includes EXCLUDE REGEX opencv)
  set_target_properties(OpenImageIO::OpenImageIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${openimageio_includes}")
endif()

# What every target compiles with: AVX2 at least, and no fast-math, because NaN and infinity must be seen and counted.
add_library(warpath_flags INTERFACE)
# GCC 12 warns of overlaps and overflows that inlined std::string and std::vector code cannot have (GCC bugs 105651, 105762).
target_compile_options(warpath_flags INTERFACE -march=x86-64-v3 -Wall -Wextra -Wshadow -fno-math-errno -fno-trapping-math
                                               -fno-semantic-interposition
                                               -Wno-restrict -Wno-stringop-overflow)

# warpath_folder(NAME [folders and libraries it may use]... [FOR_TESTS file...])
# Makes the library warpath_NAME of the sources in the current folder (but not main.cpp), and NAME_test of the tests beside them.
# PRECOMPILE reads the headers of other libraries once for the whole folder: where that takes longer than its own code.
# Files FOR_TESTS make a library of their own, warpath_NAME_for_tests: what tests of this and other folders share.
function(warpath_folder NAME)
  cmake_parse_arguments(PARSE_ARGV 1 folder PRECOMPILE "" FOR_TESTS)
  list(TRANSFORM folder_FOR_TESTS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  file(GLOB sources CONFIGURE_DEPENDS *.cpp)
  file(GLOB tests CONFIGURE_DEPENDS *_test.cpp)
  list(REMOVE_ITEM sources ${tests} ${folder_FOR_TESTS} ${CMAKE_CURRENT_SOURCE_DIR}/main.cpp "")
  add_library(warpath_${NAME} STATIC ${sources})
  target_include_directories(warpath_${NAME} PUBLIC ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(warpath_${NAME} PUBLIC warpath_flags ${folder_UNPARSED_ARGUMENTS})
  if(folder_PRECOMPILE)
    target_precompile_headers(warpath_${NAME} PRIVATE <fmt/format.h> <spdlog/spdlog.h> <Imath/ImathColor.h> <Imath/ImathMatrix.h>
                              <algorithm> <filesystem> <functional> <map> <memory> <optional> <string> <variant> <vector>)
  endif()
  if(NOT WARPATH_TESTS)
    return()
  endif()
  set(used warpath_${NAME})
  if(folder_FOR_TESTS)
    add_library(warpath_${NAME}_for_tests STATIC EXCLUDE_FROM_ALL ${folder_FOR_TESTS})
    target_link_libraries(warpath_${NAME}_for_tests PUBLIC warpath_${NAME})
    set(used warpath_${NAME}_for_tests)
  endif()
  if(tests)
    warpath_test(${NAME}_test ${tests})
    target_link_libraries(${NAME}_test PRIVATE ${used})
  endif()
endfunction()

# Seconds after which a test is taken to hang, on a machine ten times slower too.
set(WARPATH_TEST_TIMEOUT 3000)

# warpath_test(NAME SOURCES... [ONE_PROCESS]): a GoogleTest binary with one ctest entry for each of its tests; with ONE_PROCESS one
# entry for all of them, for tests that share what is costly to make.
function(warpath_test NAME)
  cmake_parse_arguments(PARSE_ARGV 1 test ONE_PROCESS "" "")
  find_package(GTest REQUIRED)
  include(GoogleTest)
  add_executable(${NAME} ${test_UNPARSED_ARGUMENTS})
  target_link_libraries(${NAME} PRIVATE warpath_flags GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${NAME} PRIVATE WARPATH_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  if(test_ONE_PROCESS)
    add_test(NAME ${NAME} COMMAND ${NAME})
    set_tests_properties(${NAME} PROPERTIES TIMEOUT ${WARPATH_TEST_TIMEOUT})
  else()
    gtest_discover_tests(${NAME} NO_PRETTY_VALUES DISCOVERY_TIMEOUT 600 PROPERTIES TIMEOUT ${WARPATH_TEST_TIMEOUT})
  endif()
endfunction()
