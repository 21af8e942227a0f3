#include "core/scene_io/assimp/mend_obj.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <system_error>

#include <assimp/mesh.h>

#include "core/base/file_names.h"
#include "core/base/text.h"
#include "core/scene_io/assimp/text_encoding.h"
#include "core/scene_io/assimp/words.h"

namespace core {
namespace {

/// libassimp takes a word of OBJ for a number only if it begins with a digit or a sign.
void append_number(std::string& to, std::string_view word) {
  const bool is_bare =
      word.size() > 1 && word[0] == '.' && std::isdigit(static_cast<unsigned char>(word[1])) != 0;
  to += is_bare ? " 0" : " ";
  to += word;
}

/// Cuts a comment off. A # after a point is no comment: 1.#INF.
std::string_view without_comment(std::string_view line) {
  std::size_t at = line.find('#');
  while (at != std::string_view::npos && at > 0 && line[at - 1] == '.') {
    at = line.find('#', at + 1);
  }
  return line.substr(0, at);
}

std::string at_line(std::size_t number) { return "line " + std::to_string(number) + ": "; }

/// The indices of a corner: of v, vt and vn, from 1; 0: none.
using Corner = std::array<std::uint64_t, 3>;

class ObjMender {
 public:
  ObjMender(const std::vector<ModelFile>& files, std::vector<std::string>& notes)
      : files_(files), notes_(notes) {}

  /// Returns an error text; empty: none.
  std::string run(std::string_view text) {
    std::string fault = read(text);
    const bool are_bytes = color_most_ > 1 && are_whole_;
    if (fault.empty() && (is_mixed_ || are_bytes)) {  // again, with what is known now
      has_colors_ = true;
      is_in_bytes_ = are_bytes;
      counts_ = {};
      most_ = {};
      short_faces_ = lines_and_points_ = curves_ = 0;
      out_.clear();
      fault = read(text);
    }
    if (!fault.empty()) {
      return fault;
    }
    if (counts_[0] == 0) {
      return "it has no vertex, a line such as v 0 0 0";
    }
    if (most_[0] > counts_[0]) {
      return at_line(line_of_most_) + "there is no vertex " + std::to_string(most_[0]) + ", only " +
             std::to_string(counts_[0]);
    }
    add_notes();
    return "";
  }
  const std::string& text() const { return out_; }

 private:
  std::string read(std::string_view text) {
    out_.reserve(text.size());
    Lines lines(text);
    std::string joined;
    while (lines.next()) {
      std::string_view line = trimmed(lines.line());
      const std::size_t number = lines.number();
      if (line.empty() || line.front() == '#') {  // not continued: a path may end in a backslash
        continue;
      }
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
    return "";
  }

  void add_notes() {
    const auto add_note = [&](const std::string& what, std::size_t count) {
      if (count > 0) {
        notes_.push_back(what + " are left out: " + std::to_string(count) + ".");
      }
    };
    add_note("Faces of fewer than three corners", short_faces_);
    add_note("Lines and points", lines_and_points_);
    add_note("Curves and free-form surfaces", curves_);
    if (is_in_bytes_) {
      notes_.emplace_back("Colours of vertices are whole numbers: they are taken as parts of 255.");
    }
    constexpr std::array kNames = {"vertices", "texture coordinates", "normals"};
    for (std::size_t i = 1; i < most_.size(); ++i) {
      if (most_[i] > counts_[i]) {
        notes_.push_back(std::string("Faces name ") + kNames[i] + " up to " +
                         std::to_string(most_[i]) + " of " + std::to_string(counts_[i]) +
                         "; their objects have none.");
      }
    }
  }

  std::string add(std::string_view line, std::size_t number) {
    const std::size_t end = std::min(line.find_first_of(kSpaces), line.size());
    const std::string_view keyword = line.substr(0, end);
    const std::string_view rest = trimmed(line.substr(end));
    if (keyword == "mtllib") {
      add_libraries(rest);
    } else if (keyword == "v" || keyword == "vt" || keyword == "vn") {
      return add_numbers(keyword, words_of(without_comment(rest)), number);
    } else if (keyword == "f" || keyword == "fo") {  // fo: as f, of older files
      return add_face(words_of(without_comment(rest)), number);
    } else if (keyword == "usemtl" || keyword == "g" || keyword == "o") {
      out_ += line;
      out_ += '\n';
    } else {
      lines_and_points_ += keyword == "l" || keyword == "p" ? 1U : 0U;
      curves_ += keyword == "curv" || keyword == "curv2" || keyword == "surf" ? 1U : 0U;
    }
    return "";
  }

  /// Adds a v, vt or vn. libassimp leaves out a v that has not 3, 4 or 6 numbers, and so counts
  /// those behind it wrongly.
  std::string add_numbers(std::string_view keyword, const std::vector<std::string_view>& words,
                          std::size_t number) {
    const bool is_vertex = keyword == "v";
    const std::size_t least = keyword == "vt" ? 1 : 3;
    if (words.size() < least) {
      return at_line(number) + std::string(keyword) + " has " + std::to_string(words.size()) +
             " of " + std::to_string(least) + " numbers";
    }
    const bool is_colored = is_vertex && words.size() >= 6;
    const bool is_weighted = is_vertex && words.size() == 4 && !has_colors_;
    const std::size_t used = is_colored    ? 6
                             : is_weighted ? 4
                                           : std::min<std::size_t>(words.size(), 3);
    out_ += keyword;
    for (std::size_t i = 0; i < used; ++i) {
      const std::string_view word = words[i];
      const Number kind = word.size() > kWordMost ? Number::kNone : number_of(word);
      const bool is_place = is_vertex && !(is_colored && i >= 3);
      if (kind == Number::kNone || (kind == Number::kNotFinite && is_place)) {
        return fault_of_number(number, word);
      }
      if (!is_place && is_vertex && kind == Number::kFinite) {
        append_color(word);
      } else {
        append_number(out_, kind == Number::kFinite ? word : "0");
      }
    }
    out_ += keyword == "vt" && used == 1 ? " 0" : "";
    is_mixed_ = is_mixed_ || (is_colored && !has_colors_ && counts_[0] > 0);
    has_colors_ = has_colors_ || is_colored;
    out_ += is_vertex && has_colors_ && !is_colored ? " 1 1 1" : "";  // libassimp's are black
    out_ += '\n';
    ++counts_[is_vertex ? 0 : keyword == "vt" ? 1 : 2];
    return "";
  }

  void append_color(std::string_view word) {
    const double value = number_in(word).value_or(0);
    color_most_ = std::max(color_most_, value);
    are_whole_ = are_whole_ && value == std::floor(value);
    append_number(out_, is_in_bytes_ ? std::to_string(value / 255) : word);
  }

  std::string add_face(const std::vector<std::string_view>& words, std::size_t number) {
    if (words.size() < 3) {
      ++short_faces_;
      return "";
    }
    if (words.size() > AI_MAX_FACE_INDICES) {
      return at_line(number) + "a face of more than " + std::to_string(AI_MAX_FACE_INDICES) +
             " corners";
    }
    corners_.clear();
    std::array<bool, 3> have_all = {true, true, true};
    for (const std::string_view word : words) {
      Corner corner{};
      if (!read_corner(word, corner)) {
        return at_line(number) + std::string(word.substr(0, kShown)) +
               " is not a corner such as 1, 1/2 or 1/2/3, of the " + std::to_string(counts_[0]) +
               " vertices so far";
      }
      for (std::size_t i = 0; i < corner.size(); ++i) {
        have_all[i] = have_all[i] && corner[i] != 0;
      }
      corners_.push_back(corner);
    }
    out_ += 'f';
    for (const Corner& corner : corners_) {
      out_ += ' ';
      for (std::size_t i = 0; i < corner.size(); ++i) {
        const bool is_written = have_all[i];
        out_ += i == 1 && (have_all[1] || have_all[2]) ? "/" : "";
        out_ += i == 2 && have_all[2] ? "/" : "";
        out_ += is_written ? std::to_string(corner[i]) : "";
        if (is_written && corner[i] > most_[i]) {
          most_[i] = corner[i];
          line_of_most_ = i == 0 ? number : line_of_most_;
        }
      }
    }
    out_ += '\n';
    return "";
  }

  /// Returns false for words that are none. Indices below 0 count back from the latest.
  bool read_corner(std::string_view word, Corner& corner) const {
    for (std::size_t i = 0; i < corner.size(); ++i) {
      const std::size_t end = std::min(word.find('/'), word.size());
      std::string_view part = word.substr(0, end);
      part.remove_prefix(part.starts_with('+') ? 1 : 0);
      std::int64_t index = 0;
      if (!part.empty()) {
        const auto [last, error] = std::from_chars(part.data(), part.data() + part.size(), index);
        if (error != std::errc() || last != part.data() + part.size() || index == 0 ||
            (i == 0 && index + static_cast<std::int64_t>(counts_[0]) < 0)) {
          return false;
        }
      } else if (i == 0) {
        return false;
      }
      if (index < 0) {
        index = std::max<std::int64_t>(index + 1 + static_cast<std::int64_t>(counts_[i]), 0);
      }
      corner[i] = static_cast<std::uint64_t>(index);
      word.remove_prefix(std::min(end + 1, word.size()));
    }
    return word.empty();
  }

  /// names: several, or one with spaces.
  void add_libraries(std::string_view names) {
    const auto is_file = [&](std::string_view name) {
      return std::any_of(files_.begin(), files_.end(), [&](const ModelFile& file) {
        return equal_ignoring_case(last_part(file.name), last_part(name));
      });
    };
    names = is_file(names) ? names : unquoted(trimmed(names.substr(0, names.find(" #"))));
    const auto parts = words_of(names);
    const bool is_one = is_file(names) && !std::all_of(parts.begin(), parts.end(), is_file);
    const auto words = is_one ? std::vector{names} : parts;
    const bool are_files = std::all_of(words.begin(), words.end(), [](std::string_view word) {
      return in_lower_case(word).ends_with(".mtl");
    });
    for (const std::string_view name : are_files ? words : std::vector{names}) {
      out_ += "mtllib ";
      out_ += name;
      out_ += '\n';
    }
  }

  static constexpr std::size_t kShown = 40;  ///< bytes of a word in an error text

  const std::vector<ModelFile>& files_;
  std::vector<std::string>& notes_;
  std::string out_;
  std::vector<Corner> corners_;   ///< of a face
  Corner counts_{};               ///< of v, vt and vn so far
  Corner most_{};                 ///< the largest indices of faces
  std::size_t line_of_most_ = 0;  ///< of vertices
  bool has_colors_ = false;
  double color_most_ = 0;     ///< of the vertices' colours
  bool are_whole_ = true;     ///< All of these are whole numbers.
  bool is_in_bytes_ = false;  ///< These go up to 255, not to 1.
  bool is_mixed_ = false;     ///< Some vertices before the first with a colour have none.
  std::size_t short_faces_ = 0;
  std::size_t lines_and_points_ = 0;
  std::size_t curves_ = 0;
};

}  // namespace

std::string mend_obj(std::vector<ModelFile>& files, std::vector<std::string>& notes) {
  make_utf8(files.front().content);
  ObjMender mender(files, notes);
  std::string fault = mender.run(text_of(files.front().content));
  files.front().content = bytes_of(mender.text());
  return fault;
}

}  // namespace core
