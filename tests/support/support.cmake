# Helpers shared by the test programs.
set(SUPPORT_SOURCES bsdf_cases.cpp scenes.cpp statistics.cpp synthetic.cpp)
