/* The step as a Functional Mock-up Unit: FMI 3.0, co-simulation. A value reference is the place of a number in the
   block; 0 is the time. Source: Modelica Association, FMI specification 3.0, sections 2 and 4. */

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kernel.c"

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status;
typedef void (*Logger)(void *environment, Status, const char *category, const char *message);
typedef struct {
  double *block, *given;
  size_t bytes;
  void *environment;
  Logger logger;
} Unit;
enum { NEAR_STEPS = 1000000 }; /* a communication step may miss whole steps by a millionth of one */

static Status failed(const Unit *u, const char *message) {
  if (u && u->logger) u->logger(u->environment, ERROR, "logStatusError", message);
  return ERROR;
}

static double now(const double *a) { return a[BEGIN] + a[COUNT] * a[STEP]; }

/* the block of resources/scene.bin, with room for work; NULL: it cannot be read */
static double *read_block(const char *folder, size_t *bytes) {
  const char *bare = strncmp(folder, "file://", 7) ? folder : folder + 7;
  size_t length = strlen(bare), known = 0;
  char *path = malloc(length + 16);
  double head[HEAD], *block = NULL;
  FILE *file;
  if (!path) return NULL;
  memcpy(path, bare, length);
  strcpy(path + length, length && bare[length - 1] != '/' ? "/scene.bin" : "scene.bin");
  file = fopen(path, "rb");
  free(path);
  if (file && fread(head, sizeof head, 1, file) == 1 && head[MARK] == 1) {
    *bytes = (size_t)head[TOTAL] * sizeof(double), known = (size_t)head[END];
    block = calloc(1, *bytes);
    if (block) memcpy(block, head, sizeof head);
    if (block && fread(block + HEAD, sizeof(double), known - HEAD, file) != known - HEAD) free(block), block = NULL;
  }
  if (file) fclose(file);
  return block;
}

API const char *fmi3GetVersion(void) { return "3.0"; }

API Status fmi3SetDebugLogging(void *unit, bool on, size_t count, const char *const names[]) {
  (void)unit, (void)on, (void)count, (void)names;
  return OK;
}

API void fmi3FreeInstance(void *unit) {
  Unit *u = unit;
  if (u) free(u->block), free(u->given), free(u);
}

API void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *folder, bool visible, bool logs,
                                      bool events, bool early, const uint32_t needed[], size_t count,
                                      void *environment, Logger logger, void *update) {
  Unit *u = calloc(1, sizeof *u);
  (void)name, (void)token, (void)visible, (void)logs, (void)events, (void)early, (void)needed, (void)count, (void)update;
  if (!u) return NULL;
  u->environment = environment, u->logger = logger;
  u->given = folder ? read_block(folder, &u->bytes) : NULL;
  u->block = u->given ? malloc(u->bytes) : NULL;
  if (!u->block) {
    failed(u, "resources/scene.bin cannot be read, or there is no memory for it; export the scene again");
    fmi3FreeInstance(u);
    return NULL;
  }
  outputs(u->given);
  memcpy(u->block, u->given, u->bytes);
  return u;
}

API void *fmi3InstantiateModelExchange(void) { return NULL; }
API void *fmi3InstantiateScheduledExecution(void) { return NULL; }

API Status fmi3EnterInitializationMode(void *unit, bool has_tolerance, double tolerance, double start, bool ends,
                                       double stop) {
  (void)has_tolerance, (void)tolerance, (void)ends, (void)stop;
  ((Unit *)unit)->block[BEGIN] = start;
  return OK;
}

API Status fmi3ExitInitializationMode(void *unit) { return unit ? OK : ERROR; }
API Status fmi3EnterConfigurationMode(void *unit) { return unit ? OK : ERROR; }
API Status fmi3ExitConfigurationMode(void *unit) { return unit ? OK : ERROR; }
API Status fmi3EnterStepMode(void *unit) { return unit ? OK : ERROR; }
API Status fmi3Terminate(void *unit) { return unit ? OK : ERROR; }

API Status fmi3Reset(void *unit) {
  Unit *u = unit;
  memcpy(u->block, u->given, u->bytes);
  return OK;
}

API Status fmi3GetFloat64(void *unit, const uint32_t places[], size_t count, double values[], size_t room) {
  const Unit *u = unit;
  const double *a = u->block;
  if (room < count) return failed(u, "fmi3GetFloat64: fewer values than references");
  for (size_t i = 0; i < count; i++) {
    if (places[i] && (places[i] < a[OWN] || places[i] >= a[TOTAL])) return failed(u, "fmi3GetFloat64: unknown reference");
    values[i] = places[i] ? a[places[i]] : now(a);
  }
  return OK;
}

API Status fmi3SetFloat64(void *unit, const uint32_t places[], size_t count, const double values[], size_t given) {
  Unit *u = unit;
  if (given < count) return failed(u, "fmi3SetFloat64: fewer values than references");
  for (size_t i = 0; i < count; i++) {
    if (places[i] < u->block[OWN] || places[i] >= u->block[VALUES])
      return failed(u, "fmi3SetFloat64: the variable is neither an input nor a parameter");
    if (!(values[i] - values[i] == 0)) return failed(u, "fmi3SetFloat64: a value is not finite");
    u->block[places[i]] = values[i];
  }
  return OK;
}

API Status fmi3DoStep(void *unit, double from, double length, bool kept, bool *events, bool *ends, bool *early,
                      double *reached) {
  Unit *u = unit;
  double h = u->block[STEP], count = length / h, whole = (double)(long long)(count + 0.5), slack = 1.0 / NEAR_STEPS;
  char message[256];
  (void)kept;
  *events = *ends = *early = false, *reached = now(u->block);
  if (!(count >= 1 - slack && count < 2e9 && size(count - whole) <= slack)) {
    snprintf(message, sizeof message, "communication step %.9g s: expected a multiple of the step of the unit, %.9g s", length, h);
    return failed(u, message);
  }
  if (!(size(from - *reached) <= 0.001 * h)) {
    snprintf(message, sizeof message, "communication point %.9g s: the unit is at %.9g s", from, *reached);
    return failed(u, message);
  }
  int at = march(u->block, (int)whole);
  *reached = now(u->block);
  if (!at) return OK;
  snprintf(message, sizeof message, "t = %.9g s: the contact forces did not converge; export with a smaller step", *reached + h);
  return failed(u, message);
}

API Status fmi3GetFMUState(void *unit, void **state) {
  const Unit *u = unit;
  if (!*state && !(*state = malloc(u->bytes))) return failed(u, "no memory for the state");
  memcpy(*state, u->block, u->bytes);
  return OK;
}

API Status fmi3SetFMUState(void *unit, void *state) {
  memcpy(((Unit *)unit)->block, state, ((Unit *)unit)->bytes);
  return OK;
}

API Status fmi3FreeFMUState(void *unit, void **state) {
  (void)unit;
  free(*state), *state = NULL;
  return OK;
}

/* What the unit has no variables or modes for. */
#define NONE(name) API Status fmi3##name(void *unit) { return failed(unit, "fmi3" #name ": the unit has no such variables or mode"); }
#define BOTH(type) NONE(Get##type) NONE(Set##type)
BOTH(Float32) BOTH(Int8) BOTH(UInt8) BOTH(Int16) BOTH(UInt16) BOTH(Int32) BOTH(UInt32) BOTH(Int64) BOTH(UInt64)
BOTH(Boolean) BOTH(String) BOTH(Binary) BOTH(Clock) BOTH(IntervalDecimal) BOTH(IntervalFraction) BOTH(ShiftDecimal)
BOTH(ShiftFraction) BOTH(ContinuousStates) NONE(EnterEventMode) NONE(UpdateDiscreteStates) NONE(EvaluateDiscreteStates)
NONE(EnterContinuousTimeMode) NONE(CompletedIntegratorStep) NONE(SetTime) NONE(GetContinuousStateDerivatives)
NONE(GetEventIndicators) NONE(GetNominalsOfContinuousStates) NONE(GetNumberOfEventIndicators)
NONE(GetNumberOfContinuousStates) NONE(GetOutputDerivatives) NONE(ActivateModelPartition) NONE(GetDirectionalDerivative)
NONE(GetAdjointDerivative) NONE(GetNumberOfVariableDependencies) NONE(GetVariableDependencies)
NONE(SerializedFMUStateSize) NONE(SerializeFMUState) NONE(DeserializeFMUState)
