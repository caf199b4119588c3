#include "examples/paper_b/comparison.h"

// Case 2 of [Ding2025] by every method, with and without standoff, as tables and plots.
int main(int argc, char** argv) { return smoothpost::paper_b::comparison_main(argc, argv, 2); }
