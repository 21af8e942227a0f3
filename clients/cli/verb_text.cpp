#include "clients/cli/verb_text.h"

#include <utility>

#include "clients/cli/job_json.h"

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

const std::vector<std::string>* choices_for(const OptionText& option, const Choices& choices) {
  for (const std::string& name : option.names) {
    if (const auto found = choices.find(name); found != choices.end()) {
      return &found->second;
    }
  }
  return nullptr;
}

}  // namespace

void share_choices(std::span<VerbText> verbs) {
  for (VerbText& verb : verbs) {
    for (std::vector<OptionText>* options : {&verb.operands, &verb.options}) {
      for (OptionText& option : *options) {
        const auto* found = choices_for(option, verb.choices);
        // An operand's name says little beyond its verb.
        for (std::size_t i = 0; options == &verb.options && found == nullptr && i < verbs.size();
             ++i) {
          found = choices_for(option, verbs[i].choices);
        }
        option.choices = found == nullptr ? std::vector<std::string>() : *found;
      }
    }
  }
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
    if (const auto found = read.find("choices"); found != read.end()) {
      text.choices = found->get<Choices>();
    }
  } catch (const Json::exception& error) {
    return Error{ErrorCode::kInvalidArgument, error.what(), text.name};
  }
  return text;
}

}  // namespace cli
