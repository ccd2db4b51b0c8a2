# What `cmake --install` puts where of the libraries (the program's rule stands in app/), and the package that
# find_package(hpsdf) reads. One export set for each library, so that a user of core alone needs nothing that render
# links.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/hpsdf)

function(hpsdf_install_library component folder)
  install(TARGETS hpsdf_${component} EXPORT hpsdf_${component})
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder}/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT hpsdf_${component} NAMESPACE hpsdf:: FILE hpsdf-${component}.cmake DESTINATION ${package_dir})
endfunction()

hpsdf_install_library(core core)
if(TARGET hpsdf_c)
  hpsdf_install_library(c c)
endif()
if(TARGET hpsdf_physics)
  hpsdf_install_library(physics physics)
endif()
if(TARGET hpsdf_bullet)
  hpsdf_install_library(bullet physics/bullet)
endif()
if(TARGET hpsdf_mpi)
  hpsdf_install_library(mpi mpi)
endif()
if(TARGET hpsdf_openvdb)
  hpsdf_install_library(openvdb openvdb)
endif()
if(TARGET hpsdf_render)
  hpsdf_install_library(render render)
endif()

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/hpsdfConfig.cmake.in ${PROJECT_BINARY_DIR}/hpsdfConfig.cmake
  INSTALL_DESTINATION ${package_dir} NO_SET_AND_CHECK_MACRO)
# before 1.0 a minor version may break its users
write_basic_package_version_file(${PROJECT_BINARY_DIR}/hpsdfConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/hpsdfConfig.cmake ${PROJECT_BINARY_DIR}/hpsdfConfigVersion.cmake
  DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
