// Open Image Denoise in its helper process, and the errors reported if it fails. The library is
// tests/support/fake_oidn.cpp.
#include "core/denoise/oidn.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "core/base/sha256.h"
#include "core/denoise/make_denoiser.h"

namespace {

using core::HalfPicture;

/// Sets an environment variable for the lifetime of this object.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    ::setenv(name, value.c_str(), 1);
  }
  ~Variable() { ::unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

std::array<HalfPicture, 2> halves() {
  std::array<HalfPicture, 2> out;
  for (std::size_t h = 0; h < 2; ++h) {
    out[h].width = 3;
    out[h].height = 2;
    for (std::size_t c = 0; c < 3; ++c) {
      out[h].mean[c] = {1, 2, 3, 4, 5, static_cast<float>(10 * h + c)};
    }
    out[h].variance.resize(6);
  }
  return out;
}

core::OidnOptions options() {
  return {.program = TESSERA_OIDN_HELPER,
          .folder = TESSERA_FAKE_OIDN,
          .patience = std::chrono::seconds(60)};
}

core::Result<core::FilteredHalves> run(const core::OidnOptions& with) {
  return core::OidnDenoiser(with).denoise(halves(), nullptr, core::parallel_for(1));
}

/// Returns the error report for this fault of the library.
std::string report_of(const char* fault, std::chrono::seconds patience = std::chrono::seconds(60)) {
  const Variable does("FAKE_OIDN", fault);
  core::OidnOptions with = options();
  with.patience = patience;
  const auto made = run(with);
  EXPECT_FALSE(made);
  return made ? "" : made.error().message;
}

TEST(Oidn, ReturnsBothHalvesAndItsVersion) {
  const auto made = run(options());
  ASSERT_TRUE(made);
  const auto before = halves();
  for (std::size_t h = 0; h < 2; ++h) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_FLOAT_EQ(made->planes[h][c][i], 0.9F * before[h].mean[c][i]);
      }
    }
  }
  std::ifstream file(std::string(TESSERA_FAKE_OIDN) + "/libOpenImageDenoise.so.2",
                     std::ios::binary);
  const std::string library((std::istreambuf_iterator<char>(file)),
                            std::istreambuf_iterator<char>());
  EXPECT_EQ(core::to_text(made->by),
            "oidn 2.5.1, balanced, sha256 " + core::sha256_hex(library.data(), library.size()));
}

TEST(Oidn, ReportsACrash) {
  EXPECT_EQ(report_of("crash"), "Open Image Denoise: its process ended without a result");
}

TEST(Oidn, EndsAHangingProcess) {
  EXPECT_EQ(report_of("hang", std::chrono::seconds(1)),
            "Open Image Denoise: it took too long and was stopped");
}

TEST(Oidn, QuotesAFailureOnOneLine) {
  EXPECT_EQ(report_of("fail"), "Open Image Denoise: out of memory");
}

TEST(Oidn, RefusesAnotherMajorVersion) {
  EXPECT_EQ(report_of("version 3"), "Open Image Denoise: version 3 is not supported; 2 is");
}

TEST(Oidn, NamesTheSettingIfTheLibraryIsMissing) {
  core::OidnOptions with = options();
  with.folder.clear();
  const auto made = run(with);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().message,
            "Open Image Denoise: its library was not found; set TESSERA_OIDN to its folder");
}

TEST(Oidn, NamesTheFileIfTheFolderLacksIt) {
  core::OidnOptions with = options();
  with.folder = "/no/such/folder";
  const auto made = run(with);
  ASSERT_FALSE(made);
  EXPECT_NE(made.error().message.find("/no/such/folder/libOpenImageDenoise.so.2"),
            std::string::npos)
      << made.error().message;
}

TEST(Oidn, ReportsAMissingHelperProgram) {
  core::OidnOptions with = options();
  with.program = "/no/such/program";
  const auto made = run(with);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().message, "Open Image Denoise: its process ended without a result");
}

TEST(Oidn, SearchesTheNamedFolderAndItsLib) {
  {
    const Variable named("TESSERA_OIDN", TESSERA_FAKE_OIDN);
    EXPECT_EQ(core::find_oidn(), TESSERA_FAKE_OIDN);
  }
  const std::filesystem::path above = std::filesystem::path(TESSERA_FAKE_OIDN).parent_path();
  const Variable named("TESSERA_OIDN", above.string());
  EXPECT_EQ(core::find_oidn(), TESSERA_FAKE_OIDN);
}

}  // namespace
