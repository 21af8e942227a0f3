// The helper process as a program: oidn_helper denoise FOLDER.
#include "core/denoise/oidn_helper.h"

int main(int argc, char** argv) { return argc == 3 && core::serve_oidn(0, argv[2]) ? 0 : 1; }
