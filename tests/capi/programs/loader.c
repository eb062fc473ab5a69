/* A host that loads the library itself and takes everything from the one table; the path is its argument. */
#define _DEFAULT_SOURCE
#include "signorini.h"
#include <dlfcn.h>
#include <stdio.h>
#include <string.h>

int main(int count, char **arguments) {
  union {
    void *object;
    SgnResult (*function)(uint32_t, SgnApi *);
  } symbol;
  void *library = count > 1 ? dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL) : NULL;
  SgnApi api, none;
  SgnContext *context = NULL;
  SgnWorld *world = NULL;
  SgnVersion version;
  uint64_t hash = 0;
  int64_t methods = 0;
  if (!library) return printf("%s\n", dlerror()), 1;
  symbol.object = dlsym(library, "sgn_get_api");
  if (!symbol.object) return 2;
  memset(&api, 0, sizeof api);
  api.struct_size = sizeof api;
  if (symbol.function(SGN_ABI_VERSION + 1, &api) != SGN_ERROR_ABI_MISMATCH || api.version) return 3;
  if (symbol.function(SGN_ABI_VERSION, &api) != SGN_OK || api.struct_size != sizeof api) return 4;
  /* Every place of the table is filled. */
  memset(&none, 0, sizeof none);
  for (size_t place = 8; place < sizeof api; place += sizeof(void *)) {
    if (memcmp((char *)&api + place, (char *)&none + place, sizeof(void *)) == 0) return printf("place %d is empty\n", (int)place), 5;
  }
  if (api.version_init(&version, sizeof version) || api.version(&version) || version.abi != SGN_ABI_VERSION) return 6;
  if (api.query(SGN_CAPABILITY_METHODS, &methods) || methods != 3 || api.query(999, &methods) != SGN_ERROR_UNSUPPORTED) return 7;
  if (api.context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context) || api.world_create(context, NULL, &world)) return 8;
  if (api.world_state_hash(world, &hash) || hash == 0) return 9;
  if (api.world_destroy(world) || api.context_destroy(context)) return 10;
  if (dlclose(library)) return 11;
  printf("PASS\n");
  return 0;
}
