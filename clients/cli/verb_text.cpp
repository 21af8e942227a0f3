#include "clients/cli/verb_text.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "clients/cli/job_json.h"

extern char** environ;

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

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

OptionText read_option(const Json& json) {
  OptionText option;
  for (const Json& name : json.at("names")) {
    option.names.push_back(name.get<std::string>());
  }
  option.value = text_at(json, "value");
  option.text = text_at(json, "text");
  option.variable = text_at(json, "variable");
  option.preset = text_at(json, "preset");
  option.repeats = json.value("repeats", false);
  return option;
}

Error system_error(int code) {
  return Error{ErrorCode::kInternal, std::error_code(code, std::generic_category()).message(), "/proc/self/exe"};
}

std::string read_all(int pipe_end) {
  std::string text;
  std::array<char, 4096> piece{};
  for (ssize_t count = 0; (count = read(pipe_end, piece.data(), piece.size())) > 0;) {
    text.append(piece.data(), static_cast<std::size_t>(count));
  }
  return text;
}

/// What `tessera VERB --describe` prints.
core::Result<std::string> ask(std::string verb) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return system_error(errno);
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  std::string name = "tessera";
  std::string flag(kDescribe);
  const std::array<char*, 4> args = {name.data(), verb.data(), flag.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawn(&child, "/proc/self/exe", &actions, nullptr, args.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  std::string text = failed == 0 ? read_all(ends[0]) : "";
  close(ends[0]);
  if (failed != 0) {
    return system_error(failed);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != kDone) {
    return Error{ErrorCode::kInternal, "cannot be described", verb};
  }
  return text;
}

}  // namespace

Json describe(const CLI::App& app) {
  Json operands = Json::array();
  Json options = Json::array();
  for (const CLI::Option* option : app.get_options()) {
    (option->get_positional() ? operands : options).push_back(describe_option(*option));
  }
  return {{"text", app.get_description()}, {"operands", std::move(operands)}, {"options", std::move(options)}};
}

core::Result<VerbText> read_verb_text(const Verb& verb, const std::string& json) {
  VerbText text;
  text.name = verb.name;
  text.summary = verb.summary;
  try {
    const Json read = Json::parse(json);
    text.text = text_at(read, "text");
    for (const Json& operand : read.at("operands")) {
      text.operands.push_back(read_option(operand));
    }
    for (const Json& option : read.at("options")) {
      text.options.push_back(read_option(option));
    }
  } catch (const Json::exception& error) {
    return Error{ErrorCode::kInvalidArgument, error.what(), text.name};
  }
  return text;
}

core::Result<std::vector<VerbText>> describe_verbs() {
  std::vector<VerbText> found;
  for (const Verb& verb : verbs()) {
    const auto said = ask(std::string(verb.name));
    if (!said) {
      return said.error();
    }
    auto text = read_verb_text(verb, *said);
    if (!text) {
      return text.error();
    }
    found.push_back(*std::move(text));
  }
  return found;
}

}  // namespace cli
