/* A stranger's program: C99, nothing of this project but the installed header and library. */
#include <smoothpost/smoothpost.h>
#include <stdio.h>

int main(void) {
  printf("abi %d\n", (int)smoothpost_abi_version());
  return smoothpost_abi_version() > 0 ? 0 : 1;
}
