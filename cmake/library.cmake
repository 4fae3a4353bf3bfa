# One shared library of all that an Integrator needs, and what find_package(warpath) finds.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(parts warpath_integrate warpath_family warpath_train warpath_warp warpath_nn warpath_path warpath_core)
list(TRANSFORM parts REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>" OUTPUT_VARIABLE objects)
add_library(warpath_library SHARED ${objects})
set_target_properties(warpath_library PROPERTIES OUTPUT_NAME warpath EXPORT_NAME warpath VERSION ${PROJECT_VERSION} SOVERSION 0)
target_link_libraries(warpath_library PRIVATE $<BUILD_INTERFACE:PkgConfig::HWY> TBB::tbb spdlog::spdlog PUBLIC fmt::fmt)
target_include_directories(warpath_library INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_compile_features(warpath_library INTERFACE cxx_std_20)

install(TARGETS warpath_library EXPORT warpath COMPONENT library)
install(DIRECTORY include/warpath DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT library)
install(EXPORT warpath NAMESPACE warpath:: FILE warpathTargets.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/warpath COMPONENT library)
file(WRITE ${CMAKE_BINARY_DIR}/warpathConfig.cmake
     "include(CMakeFindDependencyMacro)\nfind_dependency(fmt)\ninclude(\${CMAKE_CURRENT_LIST_DIR}/warpathTargets.cmake)\n")
write_basic_package_version_file(${CMAKE_BINARY_DIR}/warpathConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/warpathConfig.cmake ${CMAKE_BINARY_DIR}/warpathConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/warpath COMPONENT library)
