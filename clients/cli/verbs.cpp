#include <array>

#include "clients/cli/cli.h"

namespace cli {
namespace {

constexpr std::array kVerbs = {
    Verb{"serve", "start the service", nullptr},
    Verb{"keys", "add, list and remove the keys of a server", nullptr},
    Verb{"check", "verify a data directory", nullptr},
    Verb{"backup", "copy a data directory that a server uses", nullptr},
    Verb{"worker", "render parts of a server's jobs on this machine", nullptr},
    Verb{"denoise", "the helper process of Open Image Denoise", nullptr},
    Verb{"render", "render one image without a service", nullptr},
    Verb{"lab", "run an experiment on estimators without a service", nullptr},
    Verb{"submit", "submit a job to a server", &submit},
    Verb{"batch", "submit a series of jobs to a server", &batch},
    Verb{"watch", "follow a job until it ends", &watch},
    Verb{"fetch", "download the image of a job", &fetch},
    Verb{"jobs", "list the jobs of a server", &jobs},
    Verb{"show", "show what a job is and how far it is", &show},
    Verb{"pause", "pause jobs", &pause_jobs},
    Verb{"resume", "let paused jobs go on", &resume_jobs},
    Verb{"cancel", "cancel jobs", &cancel},
    Verb{"retry", "try failed jobs again", &retry},
    Verb{"extend", "let a finished job go on", &extend},
    Verb{"delete", "delete jobs that have ended", &delete_jobs},
    Verb{"upload", "upload models and environment maps", &upload},
    Verb{"scenes", "list the scenes of a server", &scenes},
    Verb{"merge", "merge films of the same image", &merge},
    Verb{"compare", "compare two jobs, or a job and an image", &compare},
    Verb{"meter", "print what the meter of a job has measured", &meter},
    Verb{"drain", "have a server take no new jobs", &drain},
    Verb{"health", "check whether a server is ready", &health},
    Verb{"completion", "print completions for a shell", &completion},
    Verb{"man", "print the manual page", &man},
};

}  // namespace

std::span<const Verb> verbs() { return kVerbs; }

}  // namespace cli
