/* FMI 3.0 co-simulation of a machine that lathesim compiled: run_block advances it by one sample, outputs first, then the integration.
 *
 * The outputs at a communication point follow from the inputs there. So the sample that begins at the point is computed when an output is
 * read or the step is done, whichever is first; where an input changes in between, the machine is put back and the sample computed again.
 * Source: Functional Mock-up Interface 3.0, sections 2.2 and 4.2. Left out: event mode, early return, states to be saved and set.
 */
#include "machine.h"
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { OK = 0, ERROR = 3 };
enum { CREATED, INITIALIZING, RUNNING, TERMINATED };
enum { ARRAYS = MEMORIES + TABLES + NOISES };
typedef void (*Logger)(void *environment, int status, const char *category, const char *message);

extern int32_t run_block(int64_t *done, void **fault, int64_t first, int64_t count, double period, double step, int64_t steps,
                         double *parameters, double *states, double *discrete, int64_t *memories, int64_t *tables, int64_t *noise,
                         double *record);
/* numba's code names it and never calls it */
void NRT_MemInfo_call_dtor(void *unused) { (void)unused; }

typedef struct {
    double *numbers;  /* all of the file: parameters, what moves (states, discrete states, memories), tables, noise */
    double *start;    /* parameters and what moves as the file has them */
    double *before;   /* what moves, as it was before the sample that was computed ahead */
    double record[CHANNELS];
    int64_t arrays[ARRAYS][3];
    int64_t sample;   /* the number of the communication point */
    double begin;
    bool ready, finished;
    int phase;
    void *environment;
    Logger logger;
} Machine;

static int refuse(Machine *machine, const char *text, ...) {
    char message[512];
    va_list given;
    va_start(given, text);
    vsnprintf(message, sizeof message, text, given);
    va_end(given);
    if (machine->logger) machine->logger(machine->environment, ERROR, "logStatusError", message);
    return ERROR;
}

static void rewind_to(Machine *machine, const double *kept) {
    memcpy(machine->numbers + PARAMETERS, kept, MOVING * sizeof(double));
    machine->ready = false;
}

static int compute(Machine *machine) {
    if (machine->ready) return OK;
    double *parameters = machine->numbers, *states = parameters + PARAMETERS, *discrete = states + STATES;
    int64_t noise[NOISES][3], done = 0;
    void *fault = NULL;
    if (INPUTS && machine->sample) memcpy(machine->before, states, MOVING * sizeof(double));
    memcpy(noise, machine->arrays + MEMORIES + TABLES, sizeof noise);
    for (int row = 0; row < NOISES; row++) {
        noise[row][0] += 8 * (machine->sample % NOISE_SAMPLES);
        noise[row][1] = noise[row][2] = 1;
    }
    int status = run_block(&done, &fault, machine->sample, 1, PERIOD, STEP, STEPS, parameters, states, discrete, machine->arrays[0],
                           machine->arrays[MEMORIES], noise[0], machine->record);
    double time = machine->begin + machine->sample * PERIOD;
    if (status) return refuse(machine, "a law of the machine has no answer at t = %g s.", time);
    for (int channel = 0; channel < CHANNELS; channel++)
        if (!isfinite(machine->record[channel])) return refuse(machine, "%s stopped being a number at t = %g s.", NAMES[channel], time);
    machine->finished = done < 0;
    machine->ready = true;
    return OK;
}

static bool read_numbers(Machine *machine, const char *folder) {
    char path[4096];
    snprintf(path, sizeof path, "%smachine.bin", folder ? folder : "");
    FILE *file = fopen(path, "rb");
    size_t count = file ? fread(machine->numbers, sizeof(double), NUMBERS, file) : 0;
    if (file) fclose(file);
    if (count != NUMBERS) refuse(machine, "%s cannot be read.", path);
    return count == NUMBERS;
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT int fmi3SetDebugLogging(void *machine, bool on, size_t count, const char *const categories[]) { return OK; }

EXPORT void fmi3FreeInstance(Machine *machine) {
    if (machine) free(machine->numbers), free(machine->start), free(machine->before), free(machine);
}

EXPORT int fmi3Reset(Machine *machine) {
    memcpy(machine->numbers, machine->start, PARAMETERS * sizeof(double));
    rewind_to(machine, machine->start + PARAMETERS);
    machine->sample = 0;
    machine->phase = CREATED;
    return OK;
}

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging, bool events,
                                         bool early, const uint32_t required[], size_t count, void *environment, Logger logger,
                                         void *intermediate) {
    Machine *machine = calloc(1, sizeof *machine);
    if (!machine) return NULL;
    machine->environment = environment;
    machine->logger = logger;
    machine->numbers = malloc(NUMBERS * sizeof(double));
    machine->start = malloc((PARAMETERS + MOVING) * sizeof(double));
    machine->before = malloc(MOVING * sizeof(double));
    if (!token || strcmp(token, TOKEN)) refuse(machine, "the model description belongs to another library.");
    else if (machine->numbers && machine->start && machine->before && read_numbers(machine, resources)) {
        for (int array = 0; array < ARRAYS; array++) {
            machine->arrays[array][0] = (int64_t)(intptr_t)(machine->numbers + ARRAY_SHAPES[array][0]);
            machine->arrays[array][1] = ARRAY_SHAPES[array][1];
            machine->arrays[array][2] = ARRAY_SHAPES[array][2];
        }
        memcpy(machine->start, machine->numbers, (PARAMETERS + MOVING) * sizeof(double));
        fmi3Reset(machine);
        return machine;
    }
    fmi3FreeInstance(machine);
    return NULL;
}

EXPORT int fmi3EnterInitializationMode(Machine *machine, bool has_tolerance, double tolerance, double start, bool has_stop, double stop) {
    machine->begin = start;
    machine->phase = INITIALIZING;
    return OK;
}

EXPORT int fmi3ExitInitializationMode(Machine *machine) {
    machine->phase = RUNNING;
    return OK;
}

EXPORT int fmi3Terminate(Machine *machine) {
    machine->phase = TERMINATED;
    return OK;
}

/* value references: 0 the time, then the parameters and inputs, then the channels */
EXPORT int fmi3GetFloat64(Machine *machine, const uint32_t references[], size_t count, double values[], size_t values_count) {
    for (size_t place = 0; place < count; place++) {
        uint32_t reference = references[place];
        if (reference > PARAMETERS + CHANNELS) return refuse(machine, "there is no variable %u.", reference);
        if (reference > PARAMETERS) {
            if (compute(machine) != OK) return ERROR;
            values[place] = machine->record[reference - PARAMETERS - 1];
        } else values[place] = reference ? machine->numbers[reference - 1] : machine->begin + machine->sample * PERIOD;
    }
    return OK;
}

EXPORT int fmi3SetFloat64(Machine *machine, const uint32_t references[], size_t count, const double values[], size_t values_count) {
    for (size_t place = 0; place < count; place++) {
        uint32_t reference = references[place];
        if (reference == 0 || reference > PARAMETERS) return refuse(machine, "variable %u cannot be set.", reference);
        double *value = machine->numbers + reference - 1;
        if (!isfinite(values[place])) return refuse(machine, "variable %u is to be %g.", reference, values[place]);
        if (*value == values[place]) continue;
        if (!IS_INPUT[reference - 1] && machine->phase > INITIALIZING)
            return refuse(machine, "variable %u is fixed while the machine runs.", reference);
        if (machine->ready) rewind_to(machine, machine->sample ? machine->before : machine->start + PARAMETERS);
        *value = values[place];
    }
    return OK;
}

EXPORT int fmi3DoStep(Machine *machine, double point, double size, bool no_way_back, bool *event, bool *terminate, bool *early,
                      double *last) {
    double ahead = (point - machine->begin) / PERIOD - machine->sample, samples = size / PERIOD;
    *event = *terminate = *early = false;
    *last = point;
    if (fabs(ahead) > 1e-3) return refuse(machine, "a step begins at t = %g s, and the machine is elsewhere.", point);
    if (!(samples > 0.5) || fabs(samples - round(samples)) > 1e-3)
        return refuse(machine, "a step of %g s is no multiple of %g s.", size, PERIOD);
    for (int64_t left = llround(samples); left && !*terminate; left--) {
        if (compute(machine) != OK) return ERROR;
        machine->sample++;
        machine->ready = false;
        if (ENDS && compute(machine) != OK) return ERROR;
        *terminate = ENDS && machine->finished;
    }
    *last = machine->begin + machine->sample * PERIOD;
    return OK;
}

EXPORT int fmi3UpdateDiscreteStates(Machine *machine, bool *needed, bool *terminate, bool *nominals, bool *values, bool *defined,
                                    double *next) {
    *needed = *terminate = *nominals = *values = *defined = false;
    return OK;
}

#define YES(name) EXPORT int fmi3##name(void) { return OK; }
#define NO(name) EXPORT int fmi3##name(void) { return ERROR; }
#define BOTH(kind) NO(Get##kind) NO(Set##kind)
YES(EnterEventMode) YES(EnterStepMode) YES(EnterConfigurationMode) YES(ExitConfigurationMode)
BOTH(Float32) BOTH(Int8) BOTH(UInt8) BOTH(Int16) BOTH(UInt16) BOTH(Int32) BOTH(UInt32) BOTH(Int64) BOTH(UInt64) BOTH(Boolean)
BOTH(String) BOTH(Binary) BOTH(Clock) BOTH(FMUState) BOTH(IntervalDecimal) BOTH(IntervalFraction) BOTH(ShiftDecimal)
BOTH(ShiftFraction) BOTH(ContinuousStates)
NO(FreeFMUState) NO(SerializedFMUStateSize) NO(SerializeFMUState) NO(DeserializeFMUState) NO(GetNumberOfVariableDependencies)
NO(GetVariableDependencies) NO(GetDirectionalDerivative) NO(GetAdjointDerivative) NO(EvaluateDiscreteStates)
NO(EnterContinuousTimeMode) NO(CompletedIntegratorStep) NO(SetTime) NO(GetContinuousStateDerivatives) NO(GetEventIndicators)
NO(GetNominalsOfContinuousStates) NO(GetNumberOfEventIndicators) NO(GetNumberOfContinuousStates) NO(GetOutputDerivatives)
NO(ActivateModelPartition)
EXPORT void *fmi3InstantiateModelExchange(void) { return NULL; }
EXPORT void *fmi3InstantiateScheduledExecution(void) { return NULL; }
