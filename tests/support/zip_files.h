/// Makes zip archives.
#pragma once

#include <string>
#include <vector>

namespace test_support {

struct ZipFile {
  std::string name;
  std::string content;
  bool deflate = false;
};
std::string make_zip(const std::vector<ZipFile>& files);

}  // namespace test_support
