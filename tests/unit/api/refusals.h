/// Cases of refusals in text files: a request on a line, and below, indented by two, the pointer
/// and the message of each fault, which goes on in lines indented by four. {63*k}: k, 63 times. #
/// begins a comment.
#pragma once

#include <fstream>
#include <regex>
#include <string>
#include <vector>

#include "api/problem.h"

namespace test_support {

struct Refusal {
  std::string request;
  std::vector<api::FieldError> errors;
};

/// Writes out {63*k} as k, 63 times.
inline std::string written_out(std::string text) {
  static const std::regex kRepeated(R"(\{(\d+)\*(.)\})");
  std::smatch found;
  while (std::regex_search(text, found, kRepeated)) {
    text = found.prefix().str() + std::string(std::stoul(found[1]), *found[2].first) +
           found.suffix().str();
  }
  return text;
}

inline std::vector<Refusal> refusals_in(const std::string& path) {
  std::vector<Refusal> out;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') {
      continue;
    }
    line = written_out(line);
    if (line.starts_with("    ")) {
      out.back().errors.back().detail += line.substr(3);
    } else if (line.starts_with("  ")) {
      const std::size_t colon = line.find(": ");
      out.back().errors.push_back({line.substr(2, colon - 2), line.substr(colon + 2)});
    } else {
      out.push_back({line, {}});
    }
  }
  return out;
}

}  // namespace test_support
