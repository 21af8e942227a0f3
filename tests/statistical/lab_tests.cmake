set(LAB_TEST_SOURCES
  lab_lessons_test.cpp
  lab_test.cpp
  lab_truth_test.cpp)
