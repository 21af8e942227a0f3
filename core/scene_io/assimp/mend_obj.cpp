#include "core/scene_io/assimp/mend_text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "core/scene_io/assimp/words.h"

namespace core {
namespace {

std::string small_letters(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

/// Whether a word is NaN or infinite, as programs write them.
bool is_not_finite(std::string_view word) {
  word.remove_prefix(!word.empty() && (word.front() == '-' || word.front() == '+') ? 1 : 0);
  const std::string begin = small_letters(word.substr(0, 3));
  return begin == "nan" || begin == "inf";
}

/// Returns an error text if one of the words is no finite number.
std::string fault_of(const std::vector<std::string_view>& words, std::size_t line) {
  const auto found = std::find_if(words.begin() + 1, words.end(), is_not_finite);
  return found == words.end() ? ""
                              : "line " + std::to_string(line) + ": " + std::string(*found) +
                                    " is not a finite number";
}

/// libassimp takes a word of OBJ for a number only if it begins with a digit or a sign.
void append_number(std::string& to, std::string_view word) {
  const bool is_bare =
      word.size() > 1 && word[0] == '.' && std::isdigit(static_cast<unsigned char>(word[1])) != 0;
  to += is_bare ? " 0" : " ";
  to += word;
}

class ObjMender {
 public:
  ObjMender(const std::vector<ModelFile>& files, std::vector<std::string>& notes)
      : files_(files), notes_(notes) {}

  /// Returns an error text; empty: none.
  std::string run(std::string_view text) {
    out_.reserve(text.size());
    Lines lines(text);
    std::string joined;
    while (lines.next()) {
      std::string_view line = trimmed(lines.line());
      const std::size_t number = lines.number();
      joined.clear();
      while (line.ends_with('\\')) {
        joined += line.substr(0, line.size() - 1);
        joined += ' ';
        line = lines.next() ? trimmed(lines.line()) : std::string_view();
      }
      joined += line;
      if (std::string fault = add(joined, number); !fault.empty()) {
        return fault;
      }
    }
    if (short_faces_ > 0) {
      notes_.push_back(
          "Faces of fewer than three corners are left out: " + std::to_string(short_faces_) + ".");
    }
    return "";
  }
  const std::string& text() const { return out_; }

 private:
  std::string add(std::string_view line, std::size_t number) {
    const std::size_t end = std::min(line.find_first_of(kSpaces), line.size());
    const std::string_view keyword = line.substr(0, end);
    if (keyword == "mtllib") {
      add_libraries(trimmed(line.substr(end)));
    } else if (keyword == "v" || keyword == "vt" || keyword == "vn" || keyword == "f") {
      const auto words = words_of(line.substr(0, line.find('#')));
      if (keyword == "f" && words.size() < 4) {
        ++short_faces_;
        return "";
      }
      if (std::string fault = fault_of(words, number); !fault.empty()) {
        return fault;
      }
      out_ += keyword;
      std::for_each(words.begin() + 1, words.end(),
                    [this](std::string_view word) { append_number(out_, word); });
      out_ += '\n';
    } else {
      out_ += line;
      out_ += '\n';
    }
    return "";
  }

  /// names: several, or one with spaces.
  void add_libraries(std::string_view names) {
    const bool is_one = std::any_of(files_.begin(), files_.end(), [&](const ModelFile& file) {
      return is_same_name(last_part(file.name), last_part(names));
    });
    const auto words = is_one ? std::vector{names} : words_of(names);
    const bool are_files = std::all_of(words.begin(), words.end(), [](std::string_view word) {
      return small_letters(word).ends_with(".mtl");
    });
    for (const std::string_view name : are_files ? words : std::vector{names}) {
      out_ += "mtllib ";
      out_ += name;
      out_ += '\n';
    }
  }

  const std::vector<ModelFile>& files_;
  std::vector<std::string>& notes_;
  std::string out_;
  std::size_t short_faces_ = 0;
};

/// Layout of binary STL: 80 bytes, the number of triangles, and these with 50 bytes each.
constexpr std::size_t kStlHead = 84;
constexpr std::size_t kStlTriangle = 50;

std::string check_binary_stl(const Bytes& file) {
  for (std::size_t at = kStlHead; at + kStlTriangle <= file.size(); at += kStlTriangle) {
    std::array<float, 9> corners{};  // after the normal
    std::memcpy(corners.data(), &file[at + 12], sizeof(corners));
    if (!std::all_of(corners.begin(), corners.end(), [](float v) { return std::isfinite(v); })) {
      return "triangle " + std::to_string((at - kStlHead) / kStlTriangle + 1) +
             ": a coordinate is not a finite number";
    }
  }
  return "";
}

}  // namespace

std::string mend_obj(std::vector<ModelFile>& files, std::vector<std::string>& notes) {
  ObjMender mender(files, notes);
  std::string fault = mender.run(text_of(files.front().content));
  files.front().content = bytes_of(mender.text());
  return fault;
}

std::string mend_stl(Bytes& file) {
  std::uint32_t triangles = 0;
  if (file.size() >= kStlHead) {
    std::memcpy(&triangles, &file[kStlHead - sizeof(triangles)], sizeof(triangles));
  }
  const bool is_binary = file.size() == kStlHead + std::size_t{triangles} * kStlTriangle;
  if (is_binary || !small_letters(trimmed(text_of(file)).substr(0, 5)).starts_with("solid")) {
    return check_binary_stl(file);
  }
  std::string out;
  out.reserve(file.size());
  for (Lines lines(text_of(file)); lines.next();) {
    const std::string_view line = trimmed(lines.line());
    if (line.empty()) {
      continue;
    }
    const std::size_t end = std::min(line.find_first_of(kSpaces), line.size());
    const std::string keyword = small_letters(line.substr(0, end));
    const bool is_named = keyword == "solid" || keyword == "endsolid";
    out += keyword + (is_named ? std::string(line.substr(end)) : small_letters(line.substr(end)));
    out += '\n';
    if (keyword == "vertex") {
      if (std::string fault = fault_of(words_of(line), lines.number()); !fault.empty()) {
        return fault;
      }
    }
  }
  file = bytes_of(out);
  return "";
}

}  // namespace core
