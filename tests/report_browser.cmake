# The report in a real browser: report_browser_data writes pages, report_browser_test.py opens them in headless Chromium.
find_program(WARPATH_CHROMIUM NAMES chromium chromium-browser google-chrome)
find_package(Python3 COMPONENTS Interpreter QUIET)
add_executable(report_browser_data ${CMAKE_CURRENT_LIST_DIR}/report_browser_data.cpp)
target_link_libraries(report_browser_data PRIVATE warpath_report)
if(WARPATH_CHROMIUM AND Python3_FOUND)
  add_test(NAME report_browser COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/report_browser_test.py
                                       --chromium ${WARPATH_CHROMIUM} --data $<TARGET_FILE:report_browser_data>)
  set_tests_properties(report_browser PROPERTIES TIMEOUT ${WARPATH_TEST_TIMEOUT})
else()
  message(WARNING "No Chromium or no Python 3: the browser's test of the report is left out")
endif()
