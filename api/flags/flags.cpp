#include "api/flags/flags.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdio>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/text.h"

namespace flags {

using Json = nlohmann::ordered_json;

CLI::Validator key_text() {
  return {[](std::string& text) -> std::string {
            const bool was_given = !text.empty();
            CLI::detail::trim(text);
            const bool has_control = std::any_of(
                text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; });
            return text.empty() && was_given ? "is blank"
                   : has_control             ? "has control characters, which no header can hold"
                                             : "";
          },
          ""};
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({replaced, row[j] + 1, row[j - 1] + 1}));
    }
  }
  return row.back();
}

namespace {

std::optional<double> number_of(std::string_view text) {
  text.remove_prefix(text.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  return code == std::errc() && end == text.data() + text.size() ? std::optional(value)
                                                                 : std::nullopt;
}

/// Returns empty if the text is a number in the range.
std::string fault_of_number(const std::string& text, double min, double max, bool open) {
  const auto value = number_of(text);
  if (!value) {
    return '"' + text + "\" is not a number";
  }
  const bool inside = *value <= max && (open ? *value > min : *value >= min);
  return inside ? ""
                : text + " is outside " + (open ? "(" : "[") + core::shortest_text(min) + ", " +
                      core::shortest_text(max) + "]";
}

/// Option names used by other renderers, and ours.
constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kElsewhere = {{
    {"width", "size"},
    {"height", "size"},
    {"resolution", "size"},
    {"samples", "spp"},
    {"error", "relative-error"},
    {"time", "seconds"},
    {"env", "environment"},
    {"out", "output"},
}};

/// Returns the option that `unknown` (without dashes) is probably a misspelling of; empty if none
/// is near.
std::string nearest_option(const CLI::App& app, std::string_view unknown) {
  std::string best;
  std::size_t least = 3;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      const bool same = std::any_of(kElsewhere.begin(), kElsewhere.end(), [&](const auto& pair) {
        return pair.first == unknown && pair.second == name;
      });
      const std::size_t distance = same ? 0 : edit_distance(unknown, name);
      if (distance < least && distance < name.size()) {
        least = distance;
        best = name;
      }
    }
  }
  return best;
}

Json describe_option(const CLI::Option& option) {
  Json names = Json::array();
  for (const std::string& name : option.get_snames()) {
    names.push_back("-" + name);
  }
  for (const std::string& name : option.get_lnames()) {
    names.push_back("--" + name);
  }
  if (option.get_positional()) {
    names = {option.get_name(true)};
  }
  const bool is_switch = !option.get_positional() && option.get_items_expected_max() == 0;
  return {{"names", std::move(names)},
          {"value", is_switch ? "" : option.get_type_name()},
          {"text", option.get_description()},
          {"variable", option.get_envname()},
          {"preset", option.get_default_str()},
          {"repeats", option.get_items_expected_max() > 1 || option.get_expected_max() > 1}};
}

}  // namespace

int complain(const char* program, const core::Error& error, int code) {
  std::fprintf(stderr, "%s: %s%s%s\n", program, error.where.c_str(),
               error.where.empty() ? "" : ": ", error.message.c_str());
  return code;
}

std::string fault_of(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> extra = app.remaining();
  const auto unknown = std::find_if(extra.begin(), extra.end(), [](const std::string& word) {
    return word.size() > 1 && word.front() == '-';
  });
  if (unknown == extra.end()) {
    return extra.empty() ? error.what() : '"' + extra.front() + "\" is an unexpected argument";
  }
  const std::string name = unknown->substr(0, unknown->find('='));
  const std::string near = nearest_option(app, name.substr(name.find_first_not_of('-')));
  return "there is no option " + name + (near.empty() ? "" : "; did you mean --" + near + "?");
}

int parse_and_run(CLI::App& app, const std::vector<std::string>& args,
                  const std::function<int()>& body, const std::function<Choices()>& choices) {
  if (args.size() == 1 && args.front() == kDescribe) {
    std::printf("%s\n", describe(app, choices ? choices() : Choices()).dump().c_str());
    return kDone;
  }
  try {
    // CLI11 reads the arguments from the end.
    app.parse(std::vector<std::string>(args.rbegin(), args.rend()));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(error) == 0 ? kDone : kWrongUsage;  // --help
    }
    const std::string fault = fault_of(app, error);
    const char* stop = fault.back() == '?' || fault.back() == '.' ? "" : ".";
    std::fprintf(stderr, "%s: %s%s `%s --help` lists the options.\n", app.get_name().c_str(),
                 fault.c_str(), stop, app.get_name().c_str());
    return kWrongUsage;
  }
  return body();
}

CLI::Validator within(double min, double max) {
  return {[min, max](const std::string& text) { return fault_of_number(text, min, max, false); },
          ""};
}

CLI::Validator above_zero(double max) {
  return {[max](const std::string& text) { return fault_of_number(text, 0, max, true); }, ""};
}

CLI::Validator share_within(double min, double max) {
  return {[min, max](std::string& text) {
            std::string number = text;
            if (text.ends_with('%')) {
              const auto percent = number_of(text.substr(0, text.size() - 1));
              if (!percent) {
                return '"' + text + "\" is not a percentage";
              }
              number = core::shortest_text(*percent / 100);
            }
            std::string fault = fault_of_number(number, min, max, false);
            const auto share = number_of(number);
            if (share && *share > 1 && !text.ends_with('%')) {
              fault = text + " is " + core::shortest_text(*share * 100) + "%; " + text +
                      "% is more likely: write the percent sign";
            }
            if (fault.empty()) {
              text = number;
            }
            return fault;
          },
          ""};
}

Json describe(const CLI::App& app, const Choices& choices) {
  Json operands = Json::array();
  Json options = Json::array();
  for (const CLI::Option* option : app.get_options()) {
    (option->get_positional() ? operands : options).push_back(describe_option(*option));
  }
  return {{"text", app.get_description()},
          {"operands", std::move(operands)},
          {"options", std::move(options)},
          {"choices", choices}};
}

}  // namespace flags
