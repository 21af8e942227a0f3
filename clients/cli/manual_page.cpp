// tessera(1). Macros and escapes: man(7), groff_char(7).
#include <map>
#include <string_view>

#include "clients/cli/completion.h"

namespace cli {
namespace {

/// Escapes backslashes, minus signs, and a first character that would be a request.
std::string roff(std::string_view text) {
  std::string out = text.starts_with('.') || text.starts_with('\'') ? "\\&" : "";
  for (const char c : text) {
    out += c == '\\' ? std::string("\\e") : c == '-' ? std::string("\\-") : std::string(1, c);
  }
  return out;
}

std::string bold(std::string_view text) { return "\\fB" + roff(text) + "\\fR"; }
std::string italic(std::string_view text) { return "\\fI" + roff(text) + "\\fR"; }

std::string with_stop(std::string text) {
  const bool stops =
      text.empty() || std::string_view(".)").find(text.back()) != std::string_view::npos;
  return stops ? text : text + ".";
}

std::string option_entry(const OptionText& option) {
  std::string head;
  for (const std::string& name : option.names) {
    head += (head.empty() ? "" : ", ") + bold(name);
  }
  head += option.value.empty() ? "" : " " + italic(option.value);
  std::string text = roff(with_stop(option.text));
  if (!option.preset.empty()) {
    text += " Default: " + roff(option.preset) + ".";
  }
  if (!option.variable.empty()) {
    text += " Environment: " + bold(option.variable) + ".";
  }
  return ".TP\n" + head + "\n" + text + "\n";
}

std::string verb_section(const VerbText& verb) {
  std::string synopsis = "tessera " + verb.name;
  for (const OptionText& operand : verb.operands) {
    synopsis += " " + operand.value;
  }
  std::string out = ".SS " + roff(synopsis) + "\n" + roff(with_stop(verb.text)) + "\n";
  for (const OptionText& operand : verb.operands) {
    out += ".TP\n" + italic(operand.value) + "\n" + roff(with_stop(operand.text)) + "\n";
  }
  for (const OptionText& option : verb.options) {
    out += option_entry(option);
  }
  return out;
}

std::string environment(std::span<const VerbText> verbs) {
  std::map<std::string, std::string> variables;
  for (const VerbText& verb : verbs) {
    for (const OptionText& option : verb.options) {
      if (!option.variable.empty()) {
        variables.emplace(option.variable, option.names.back());
      }
    }
  }
  std::string out;
  for (const auto& [variable, option] : variables) {
    out += ".TP\n" + bold(variable) + "\nAs " + bold(option) + ", which overrides it.\n";
  }
  return out;
}

}  // namespace

std::string manual_page(std::span<const VerbText> verbs) {
  std::string out =
      ".TH TESSERA 1 \"" TESSERA_DATE "\" \"Tessera " TESSERA_VERSION
      "\"\n"
      ".SH NAME\n"
      "tessera \\- renders glTF scenes and reports the error of every image\n"
      ".SH SYNOPSIS\n"
      ".B tessera\n.I VERB\n[\\fIOPTIONS\\fR] [\\fIOPERANDS\\fR]\n"
      ".SH DESCRIPTION\n"
      "Renders glTF scenes by path tracing and reports the error of every image. One program is "
      "the server, its\n"
      "client, and a renderer of single images without a server. Results go to the standard "
      "output, everything else\n"
      "to the standard error.\n"
      ".TP\n\\fB\\-\\-help\\fR\nLists the verbs; after a verb, its options.\n.TP\n"
      "\\fB\\-\\-version\\fR\n"
      "Prints the version.\n"
      ".SH VERBS\n";
  for (const VerbText& verb : verbs) {
    out += verb_section(verb);
  }
  return out + ".SH ENVIRONMENT\n" + environment(verbs) +
         ".SH EXIT STATUS\n"
         ".TP\n0\nSuccess.\n.TP\n1\n"
         "Failure, or the job did not finish; includes missing or invalid files and requests that "
         "the server\n"
         "refuses.\n"
         ".TP\n2\nWrong usage that the command line alone shows, such as an unknown option or a "
         "number outside its range.\n"
         ".SH EXAMPLES\n"
         ".nf\n" +
         roff("tessera serve --port 9000 --data ~/renders") + "\n" +
         roff("tessera submit cornell-box --relative-error 0.03 -o cornell.png") + "\n" +
         roff("tessera render model.glb -o model.exr --seconds 10") + "\n" +
         roff("source <(tessera completion bash)") + "\n.fi\n";
}

}  // namespace cli
