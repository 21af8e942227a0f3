/// Tests of a film file in a folder of its own.
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "tests/unit/server/server_test_support.h"

namespace test_support {

class FilmFiles : public testing::Test {
 protected:
  const TemporaryFolder folder;
  const std::string path = folder.file("a.film");
};

}  // namespace test_support
