# Read by cpack, before it makes anything.
if(CPACK_SMOOTHPOST_WITH_CGAL AND CPACK_SMOOTHPOST_WITH_IPOPT AND NOT CPACK_SMOOTHPOST_FOR_OWN_USE)
  message(FATAL_ERROR
    "This build links CGAL (GPL) and Ipopt (EPL): no terms allow to hand it on (docs/licences.md). "
    "Configure with -DSMOOTHPOST_WITH_CGAL=OFF or -DSMOOTHPOST_WITH_IPOPT=OFF; "
    "for a package that stays with you: -DSMOOTHPOST_PACKAGE_FOR_OWN_USE=ON.")
endif()
