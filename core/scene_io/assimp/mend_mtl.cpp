#include "core/scene_io/assimp/mend_mtl.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <string_view>

#include "core/base/text.h"
#include "core/scene_io/assimp/text_encoding.h"
#include "core/scene_io/assimp/words.h"

namespace core {
namespace {

constexpr std::size_t kNameMost = 12;   ///< bytes of a statement that a note names
constexpr std::size_t kNamesMost = 20;  ///< of statements in a note

enum class Values { kName, kColor, kFactor, kTexture, kNone };
struct Statement {
  std::string_view word;     ///< in any case
  std::string_view written;  ///< as libassimp knows it
  Values values;
};
/// Statements that are read. Ka, light from nowhere, has no counterpart; Ks, Ni and Tf count where
/// illum says so.
constexpr std::array kStatements = {Statement{"newmtl", "newmtl", Values::kName},
                                    Statement{"kd", "Kd", Values::kColor},
                                    Statement{"ke", "Ke", Values::kColor},
                                    Statement{"ks", "Ks", Values::kColor},
                                    Statement{"tf", "Tf", Values::kColor},
                                    Statement{"d", "d", Values::kFactor},
                                    Statement{"tr", "Tr", Values::kFactor},
                                    Statement{"ns", "Ns", Values::kFactor},
                                    Statement{"ni", "Ni", Values::kFactor},
                                    Statement{"pr", "Pr", Values::kFactor},
                                    Statement{"pm", "Pm", Values::kFactor},
                                    Statement{"illum", "illum", Values::kFactor},
                                    Statement{"map_kd", "map_Kd", Values::kTexture},
                                    Statement{"map_ke", "map_Ke", Values::kTexture},
                                    Statement{"map_emissive", "map_Ke", Values::kTexture},
                                    Statement{"norm", "norm", Values::kTexture},
                                    Statement{"map_kn", "norm", Values::kTexture},
                                    Statement{"ka", "Ka", Values::kNone},
                                    Statement{"map_ka", "map_Ka", Values::kNone},
                                    Statement{"sharpness", "sharpness", Values::kNone}};

/// Options of textures. Source: P. Bourke, MTL material format.
struct Option {
  std::string_view word;
  std::size_t values_most;
  bool changes_the_picture;  ///< of maps that are read
};
constexpr std::array kOptions = {
    Option{"-blendu", 1, false},  Option{"-blendv", 1, false}, Option{"-boost", 1, false},
    Option{"-bm", 1, false},      Option{"-cc", 1, false},     Option{"-clamp", 1, false},
    Option{"-imfchan", 1, false}, Option{"-mm", 2, true},      Option{"-o", 3, true},
    Option{"-s", 3, true},        Option{"-t", 3, true},       Option{"-texres", 1, false},
    Option{"-type", 1, false}};

class MtlMender {
 public:
  explicit MtlMender(std::set<std::string>& left_out) : left_out_(left_out) {}

  std::string run(std::string_view text) {
    for (Lines lines(text); lines.next();) {
      const std::string_view line = trimmed(lines.line());
      if (!line.empty() && line.front() != '#') {
        add(line);
      }
    }
    return std::move(out_);
  }

 private:
  void leave_out(std::string_view word, std::string_view why = {}) {
    if (word.size() <= kNameMost && why.size() <= kNameMost) {
      left_out_.insert(std::string(word) + (why.empty() ? "" : " ") + std::string(why));
    }
  }

  void add(std::string_view line) {
    const std::size_t end = std::min(line.find_first_of(kSpaces), line.size());
    const std::string_view word = line.substr(0, end);
    const auto* const found =
        std::find_if(kStatements.begin(), kStatements.end(),
                     [&](const Statement& row) { return equal_ignoring_case(row.word, word); });
    if (found == kStatements.end()) {
      leave_out(word);
      return;
    }
    const std::string_view rest = trimmed(line.substr(end));
    has_material_ = has_material_ || found->values == Values::kName;
    if (rest.empty() || !has_material_) {
      return;
    }
    switch (found->values) {
      case Values::kName:
        write(found->written, rest);
        break;
      case Values::kColor:
      case Values::kFactor:
        add_numbers(*found, words_of(rest.substr(0, rest.find('#'))));
        break;
      case Values::kTexture:
        add_texture(*found, rest);
        break;
      case Values::kNone:
        break;
    }
  }

  void write(std::string_view word, std::string_view rest) {
    out_ += word;
    out_ += ' ';
    out_ += rest;
    out_ += '\n';
  }

  void add_numbers(const Statement& statement, std::vector<std::string_view> words) {
    const bool is_halo = !words.empty() && words.front() == "-halo";  // of d: less at the middle
    if (is_halo) {
      leave_out(statement.written, words.front());
      words.erase(words.begin());
    }
    const std::size_t count = statement.values == Values::kFactor ? 1 : 3;
    for (std::size_t i = 0; i < std::min(words.size(), count); ++i) {
      if (words[i].size() > kWordMost || number_of(words[i]) != Number::kFinite) {
        leave_out(statement.written, words[i]);
        return;
      }
    }
    if (words.empty()) {
      return;
    }
    words.resize(count, words.back());  // Others than the first may be missing.
    std::string values;
    for (const std::string_view word : words) {
      values += (values.empty() ? "" : " ") + std::string(word.starts_with('.') ? "0" : "");
      values += word;
    }
    write(statement.written, values);
  }

  /// rest: options and the name, which may have spaces.
  void add_texture(const Statement& statement, std::string_view rest) {
    for (;;) {
      const std::string_view word = rest.substr(0, rest.find_first_of(kSpaces));
      const auto* const option =
          std::find_if(kOptions.begin(), kOptions.end(),
                       [&](const Option& row) { return equal_ignoring_case(row.word, word); });
      if (option == kOptions.end()) {
        break;
      }
      if (option->changes_the_picture) {
        leave_out(statement.written, option->word);
      }
      rest = trimmed(rest.substr(word.size()));
      for (std::size_t i = 0; i < option->values_most; ++i) {
        const std::string_view value = rest.substr(0, rest.find_first_of(kSpaces));
        const bool is_value = option->values_most == 1 || number_of(value) != Number::kNone;
        // A name may be a number; something has to be left for it.
        if (!is_value || value.size() == rest.size()) {
          break;
        }
        rest = trimmed(rest.substr(value.size()));
      }
    }
    if (!rest.empty()) {
      write(statement.written, unquoted(rest));
    }
  }

  std::set<std::string>& left_out_;
  std::string out_;
  bool has_material_ = false;
};

}  // namespace

std::string mend_materials(std::vector<ModelFile>& files) {
  std::set<std::string> left_out;
  for (ModelFile& file : files) {
    if (in_lower_case(file.name).ends_with(".mtl")) {
      make_utf8(file.content);
      file.content = bytes_of(MtlMender(left_out).run(text_of(file.content)));
    }
  }
  std::string names;
  std::size_t count = 0;
  for (const std::string& statement : left_out) {
    if (++count <= kNamesMost) {
      names += (names.empty() ? "" : ", ") + statement;
    }
  }
  if (count > kNamesMost) {
    names += " and " + std::to_string(count - kNamesMost) + " more";
  }
  return names.empty() ? "" : "MTL: " + names + " left out.";
}

}  // namespace core
