#include <array>

#include "clients/cli/cli.h"

namespace cli {
namespace {

constexpr std::array kVerbs = {
    Verb{"serve", "start the server", nullptr},
    Verb{"keys", "add, list and remove the keys of a server", nullptr},
    Verb{"check", "verify a data directory", nullptr},
    Verb{"backup", "copy a data directory while a server uses it", nullptr},
    Verb{"worker", "render parts of a server's jobs on this machine", nullptr},
    Verb{"convert", "convert a file of another format to GLB", nullptr},
    Verb{"denoise", "helper process of Open Image Denoise", nullptr},
    Verb{"render", "render one image without a server", nullptr},
    Verb{"lab", "run an experiment on estimators without a server", nullptr},
    Verb{"submit", "submit a job to a server", &submit},
    Verb{"batch", "submit a batch of jobs to a server", &batch},
    Verb{"watch", "follow a job until it ends", &watch},
    Verb{"fetch", "download the image of a job", &fetch},
    Verb{"jobs", "list the jobs of a server", &jobs},
    Verb{"show", "show a job and its progress", &show},
    Verb{"pause", "pause jobs", &pause_jobs},
    Verb{"resume", "resume paused jobs", &resume_jobs},
    Verb{"cancel", "cancel jobs", &cancel},
    Verb{"retry", "retry jobs that have failed or are doubted", &retry},
    Verb{"extend", "extend a finished job", &extend},
    Verb{"delete", "delete jobs that have ended", &delete_jobs},
    Verb{"upload", "upload models and environment maps", &upload},
    Verb{"scenes", "list the scenes of a server", &scenes},
    Verb{"merge", "merge films of the same image", &merge},
    Verb{"compare", "compare two jobs, or a job and an image", &compare},
    Verb{"meter", "print the readings of a job's meter", &meter},
    Verb{"thumbnail", "render a small image of a model on a server", &thumbnail},
    Verb{"sign", "sign the URL of an image made from a preset", &sign},
    Verb{"mcp", "serve an agent's tools (Model Context Protocol)", &mcp},
    Verb{"drain", "make a server refuse new jobs", &drain},
    Verb{"health", "check whether a server is ready", &health},
    Verb{"completion", "print completions for a shell", &completion},
    Verb{"man", "print the manual page", &man},
};

}  // namespace

std::span<const Verb> verbs() { return kVerbs; }

}  // namespace cli
