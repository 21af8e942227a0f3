# Helpers shared by the test programs.
set(SUPPORT_SOURCES scenes.cpp statistics.cpp)
