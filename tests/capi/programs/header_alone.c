#include "signorini.h"
#include "signorini.h" /* guarded */
typedef int not_empty;
