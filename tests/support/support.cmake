#Helpers shared by the test programs.
set(SUPPORT_SOURCES bsdf_cases.cpp errors.cpp scenes.cpp statistics.cpp synthetic.cpp)
