// Files with faults, as tables: gltf_refusals.txt and gltf_repairs.txt describe their form.
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;
using Json = nlohmann::json;

struct Case {
  std::string base = "triangle.gltf";
  std::vector<std::string> changes;
  std::string expected;                ///< without its indentation
  std::vector<std::string> read_as{};  ///< changes
};

std::vector<Case> cases_of(const std::string& name) {
  std::vector<Case> all;
  std::ifstream file(TESSERA_SOURCE_DIR "/tests/unit/core/" + name);
  bool is_complete = true;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("    ")) {
      all.back().expected += line.substr(3);
    } else if (line.starts_with("  as ")) {
      all.back().read_as.push_back(line.substr(5));
    } else if (line.starts_with("  ")) {
      all.back().expected = line.substr(2);
      is_complete = true;
    } else if (line.starts_with('/') || line.starts_with("in ")) {
      if (is_complete) {
        all.emplace_back();
      }
      is_complete = false;
      if (line.starts_with('/')) {
        all.back().changes.push_back(line);
      } else {
        all.back().base = line.substr(3);
      }
    }
  }
  return all;
}

/// A file beside this one with changes.
std::string document(const std::string& base, const std::vector<std::string>& changes) {
  std::ifstream file(TESSERA_SOURCE_DIR "/tests/unit/core/" + base);
  Json json = Json::parse(file);
  for (const std::string& change : changes) {
    const std::size_t space = change.find(' ');
    const Json::json_pointer pointer(change.substr(0, space));
    if (space != std::string::npos) {
      json[pointer] = Json::parse(change.substr(space + 1));
    } else {
      json.at(pointer.parent_pointer()).erase(pointer.back());
    }
  }
  return json.dump();
}

std::string mark_of(core::ErrorCode code) {
  return code == core::ErrorCode::kInvalidArgument ? ""
         : code == core::ErrorCode::kTooLarge      ? "[too_large] "
         : code == core::ErrorCode::kMissingFiles  ? "[missing_files] "
                                                   : "[another code] ";
}

TEST(GltfRefusals, HaveThePointerAndTheReason) {
  const std::vector<Case> all = cases_of("gltf_refusals.txt");
  ASSERT_GT(all.size(), 50U);
  for (const Case& c : all) {
    SCOPED_TRACE(c.changes.front());
    const std::string file = document(c.base, c.changes);
    const auto strict = load_json_strictly(file);
    ASSERT_FALSE(strict);
    const core::Error& error = strict.error();
    const std::string mark = load_json(file) ? "" : "! ";
    EXPECT_EQ(mark + mark_of(error.code) + error.where + ": " + error.message, c.expected);
  }
}

TEST(GltfRepairs, AreReadAsAFileWithoutFaultsAndHaveAWarning) {
  const std::vector<Case> all = cases_of("gltf_repairs.txt");
  ASSERT_GT(all.size(), 25U);
  for (const Case& c : all) {
    SCOPED_TRACE(c.changes.front());
    const std::string file = document(c.base, c.changes);
    const auto mended = load_json(file);
    ASSERT_TRUE(mended) << mended.error().where << ": " << mended.error().message;
    ASSERT_EQ(mended->warnings.size(), 1U);
    const core::Warning& warning = mended->warnings[0];
    const std::string mark = load_json_strictly(file) ? "- " : "";
    EXPECT_EQ(mark + warning.code + " " + warning.pointer + ": " + warning.detail, c.expected);

    const auto faultless = load_json_strictly(document(c.base, c.read_as));
    ASSERT_TRUE(faultless) << faultless.error().where << ": " << faultless.error().message;
    EXPECT_TRUE(faultless->warnings.empty());
    EXPECT_EQ(core::write_glb(*mended), core::write_glb(*faultless));
  }
}

}  // namespace
