#include "clients/cli/command.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/cli/api_client.h"

namespace cli {

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

std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

/// Empty when the text is a number of the range.
std::string fault_of_number(const std::string& text, double min, double max, bool open) {
  const auto value = number_of(text);
  if (!value) {
    return '"' + text + "\" is no number";
  }
  const bool inside = *value <= max && (open ? *value > min : *value >= min);
  return inside ? ""
                : text + " is outside " + (open ? "(" : "[") + number_text(min) + ", " +
                      number_text(max) + "]";
}

/// What other renderers call the same.
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

/// The option's name that `unknown` (without dashes) may stand for; empty if none is near.
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

}  // namespace

std::string fault_of(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> extra = app.remaining();
  const auto unknown = std::find_if(extra.begin(), extra.end(), [](const std::string& word) {
    return word.size() > 1 && word.front() == '-';
  });
  if (unknown == extra.end()) {
    return extra.empty() ? error.what() : '"' + extra.front() + "\" is one word too many";
  }
  const std::string name = unknown->substr(0, unknown->find('='));
  const std::string near = nearest_option(app, name.substr(name.find_first_not_of('-')));
  return "there is no option " + name + (near.empty() ? "" : "; did you mean --" + near + "?");
}

int parse_and_run(CLI::App& app, const Args& args, const std::function<int()>& body,
                  const std::function<Choices()>& choices) {
  if (args.size() == 1 && args.front() == kDescribe) {
    std::printf("%s\n", describe(app, choices ? choices() : Choices()).dump().c_str());
    return kDone;
  }
  try {
    // CLI11 takes the arguments from the back.
    Args reversed(args.rbegin(), args.rend());
    app.parse(std::move(reversed));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(error) == 0 ? kDone : kWrongUsage;  // --help
    }
    const std::string fault = fault_of(app, error);
    const char* stop = fault.back() == '?' || fault.back() == '.' ? "" : ".";
    std::fprintf(stderr, "%s: %s%s `%s --help` lists what there is.\n", app.get_name().c_str(),
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
                return '"' + text + "\" is no number of percent";
              }
              number = number_text(*percent / 100);
            }
            std::string fault = fault_of_number(number, min, max, false);
            if (fault.empty()) {
              text = number;
            }
            return fault;
          },
          ""};
}

int complain(const std::string& verb, const core::Error& error) {
  const std::string place = error.where.empty() ? "" : error.where + ": ";
  std::fprintf(stderr, "tessera %s: %s%s\n", verb.c_str(), place.c_str(), error.message.c_str());
  return kFailed;
}

void add_server_flags(CLI::App& app, ServerFlags& flags) {
  app.add_option("--server", flags.url, "Address of the server")
      ->envname("TESSERA_SERVER")
      ->capture_default_str()
      ->check(CLI::Validator(
          [](const std::string& url) {
            const auto address = check_address(url);
            return address ? std::string() : address.error().message;
          },
          ""))
      ->type_name("URL");
  app.add_option("--key", flags.key, "Access key, if the server asks for one")
      ->envname("TESSERA_KEY")
      ->type_name("KEY");
}

}  // namespace cli
