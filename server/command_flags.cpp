#include "server/command_flags.h"

#include <algorithm>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "server/config.h"

namespace server {

using core::Error;
using core::ErrorCode;

core::Result<CommandFlags> parse_command_flags(std::span<const std::string_view> args,
                                               std::span<const CommandFlag> known) {
  CommandFlags flags;
  for (std::size_t i = 0; i < args.size(); ++i) {
    std::string name(args[i] == "-h" ? "--help" : args[i]);
    if (name.rfind("--", 0) != 0) {
      flags.words.push_back(std::move(name));
      continue;
    }
    const std::size_t equals = name.find('=');
    std::string value = equals == std::string::npos ? std::string() : name.substr(equals + 1);
    name = name.substr(2, equals == std::string::npos ? std::string::npos : equals - 2);
    const auto found = std::find_if(known.begin(), known.end(),
                                    [&name](const CommandFlag& flag) { return flag.name == name; });
    const bool is_about = name == "help" || name == "describe";
    if (found == known.end() && !is_about) {
      return Error{ErrorCode::kInvalidArgument, "unknown flag", "--" + name};
    }
    if (is_about || found->value.empty()) {
      flags.switches.insert(name);
      continue;
    }
    if (equals == std::string::npos) {
      if (++i == args.size()) {
        return Error{ErrorCode::kInvalidArgument, "needs a value", "--" + name};
      }
      value = std::string(args[i]);
    }
    flags.values[name] = std::move(value);
  }
  return flags;
}

bool print_command_text(const CommandFlags& flags, const CommandText& text) {
  if (flags.switches.count("help") != 0) {
    std::string help = std::string(text.text) + "\n\n";
    for (const CommandFlag& flag : text.flags) {
      std::string head = "  --" + std::string(flag.name) + (flag.value.empty() ? "" : " ") +
                         std::string(flag.value);
      head.resize(std::max<std::size_t>(head.size() + 2, 22), ' ');
      help += head + std::string(flag.text) + "\n";
    }
    help += "  -h, --help          Print this\n";
    std::fputs(help.c_str(), stdout);
    return true;
  }
  if (flags.switches.count("describe") == 0) {
    return false;
  }
  using Json = nlohmann::ordered_json;
  Json options = Json::array();
  for (const CommandFlag& flag : text.flags) {
    options.push_back({{"names", Json::array({"--" + std::string(flag.name)})},
                       {"value", flag.value},
                       {"text", flag.text}});
  }
  options.push_back(
      {{"names", Json::array({"-h", "--help"})}, {"value", ""}, {"text", "Print this"}});
  Json operands = Json::array();
  if (!text.operand.empty()) {
    operands.push_back({{"names", Json::array({text.operand})},
                        {"value", text.operand},
                        {"text", text.operand_text},
                        {"repeats", true}});
  }
  Json choices = Json::object();
  if (!text.operand_choices.empty()) {
    choices[std::string(text.operand)] = text.operand_choices;
  }
  const Json line = {{"text", text.text},
                     {"operands", std::move(operands)},
                     {"options", std::move(options)},
                     {"choices", std::move(choices)}};
  std::printf("%s\n", line.dump().c_str());
  return true;
}

core::Result<std::string> data_directory(const CommandFlags& flags) {
  if (const auto given = flags.values.find("data"); given != flags.values.end()) {
    return given->second;
  }
  const auto config = parse_config({}, process_environ);
  if (!config) {
    return config.error();
  }
  return config->data_dir;
}

}  // namespace server
