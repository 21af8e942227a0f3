#include "clients/cli/verb_text.h"

#include "clients/cli/job_json.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

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
        // Operands with the same name may differ between verbs, so only options share choices.
        for (std::size_t i = 0; options == &verb.options && found == nullptr && i < verbs.size();
             ++i) {
          found = choices_for(option, verbs[i].choices);
        }
        option.choices = found == nullptr ? std::vector<std::string>() : *found;
      }
    }
  }
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
