#include "core/scene_io/assimp/mend_stl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "core/base/text.h"
#include "core/scene_io/assimp/text_encoding.h"
#include "core/scene_io/assimp/words.h"

namespace core {
namespace {

/// Layout of binary STL: 80 bytes, the number of triangles, and these with 50 bytes each: a normal,
/// three corners and 16 bits, which some programs use for a colour.
constexpr std::size_t kHead = 84;
constexpr std::size_t kTriangle = 50;
constexpr std::size_t kBits = 48;  ///< where they begin in a triangle

/// Materialise's programs write the colour of the solid into the head, and into triangles without
/// the highest bit their own; libassimp takes those with it for coloured. Source: Wikipedia, STL
/// (file format), Color.
void mend_colors(Bytes& file, std::size_t triangles) {
  constexpr std::string_view kColor = "COLOR=";
  constexpr unsigned kIsSet = 0x8000;
  const std::size_t at = text_of(file).substr(0, kHead - 4).find(kColor);
  if (at == std::string_view::npos || at + kColor.size() + 3 > kHead - 4) {
    return;
  }
  unsigned solid = kIsSet;
  for (std::size_t i = 0; i < 3; ++i) {  // 5 bits of each, red in the lowest
    solid |= (static_cast<unsigned>(file[at + kColor.size() + i]) * 31 + 127) / 255 << 5 * i;
  }
  std::vector<std::uint16_t> bits(triangles);
  for (std::size_t i = 0; i < triangles; ++i) {
    std::memcpy(&bits[i], &file[kHead + i * kTriangle + kBits], sizeof(bits[i]));
  }
  // Some programs write no colour of triangles: all 0.
  const bool has_own = std::any_of(bits.begin(), bits.end(), [](unsigned b) { return b != 0; });
  for (std::size_t i = 0; i < triangles; ++i) {
    const bool is_own = has_own && (bits[i] & kIsSet) == 0;
    bits[i] = static_cast<std::uint16_t>(is_own ? bits[i] | kIsSet : solid);
    std::memcpy(&file[kHead + i * kTriangle + kBits], &bits[i], sizeof(bits[i]));
  }
}

/// Returns the number of triangles in the head of a binary file; 0: it has none.
std::uint32_t triangles_of(const Bytes& file) {
  std::uint32_t triangles = 0;
  if (file.size() >= kHead) {
    std::memcpy(&triangles, &file[kHead - sizeof(triangles)], sizeof(triangles));
  }
  return triangles;
}

std::string mend_binary(Bytes& file) {
  const std::size_t triangles = triangles_of(file);
  const std::size_t whole = file.size() < kHead ? 0 : (file.size() - kHead) / kTriangle;
  if (file.size() < kHead) {
    return "it is too short for a binary STL, and text begins with solid";
  }
  if (whole < triangles) {
    return "it ends in triangle " + std::to_string(whole + 1) + " of the " +
           std::to_string(triangles) + " of a binary STL; text begins with solid";
  }
  if (triangles == 0) {
    return "it has no triangles";
  }
  for (std::size_t i = 0; i < triangles; ++i) {
    std::array<float, 9> corners{};
    std::memcpy(corners.data(), &file[kHead + i * kTriangle + 12], sizeof(corners));
    if (!std::all_of(corners.begin(), corners.end(), [](float v) { return std::isfinite(v); })) {
      return "triangle " + std::to_string(i + 1) + ": a coordinate is not a finite number";
    }
  }
  file.resize(kHead + triangles * kTriangle);
  mend_colors(file, triangles);
  return "";
}

/// Returns an error text if the line of a corner has not three finite numbers.
std::string fault_of_corner(std::string_view line, std::size_t number) {
  const auto words = words_of(line);
  for (std::size_t i = 1; i < std::min<std::size_t>(words.size(), 4); ++i) {
    if (number_of(words[i]) != Number::kFinite) {
      return fault_of_number(number, words[i]);
    }
  }
  return words.size() < 4 ? "line " + std::to_string(number) + ": vertex has not three numbers"
                          : "";
}

}  // namespace

std::string mend_stl(Bytes& file, std::vector<std::string>& notes) {
  // The head of a binary file may begin with solid, too.
  if (file.size() == kHead + std::size_t{triangles_of(file)} * kTriangle) {
    return mend_binary(file);
  }
  make_utf8(file);
  constexpr std::size_t kLooked = 1024;  // bytes: several lines of text, or a head and its count
  if (!in_lower_case(trimmed(text_of(file)).substr(0, 5)).starts_with("solid") ||
      text_of(file).substr(0, kLooked).find('\0') != std::string_view::npos) {
    return mend_binary(file);
  }
  std::string out;
  out.reserve(file.size());
  std::string keyword;
  for (Lines lines(text_of(file)); lines.next();) {
    const std::string_view line = trimmed(lines.line());
    if (line.empty()) {
      continue;
    }
    const std::size_t end = std::min(line.find_first_of(kSpaces), line.size());
    keyword = in_lower_case(line.substr(0, end));
    const bool is_named = keyword == "solid" || keyword == "endsolid";
    out += keyword + (is_named ? std::string(line.substr(end)) : in_lower_case(line.substr(end)));
    out += '\n';
    if (keyword == "vertex") {
      if (std::string fault = fault_of_corner(line, lines.number()); !fault.empty()) {
        return fault;
      }
    }
  }
  if (keyword != "endsolid" && trimmed(out).find("endsolid") == std::string_view::npos) {
    notes.emplace_back("The file does not end in endsolid: its end may be missing.");
  }
  file = bytes_of(out);
  return "";
}

}  // namespace core
