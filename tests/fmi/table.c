/* An FMU of FMI 2.0 as another tool would make it: a table moved by a speed [mm/s], unless it is braked. It fails beyond 0.3 m/s. */
#include <stdlib.h>
#include <string.h>

typedef struct { double speed, position, gain; int brake; void (*log)(void *, const char *, int, const char *, const char *, ...); } Table;
typedef struct { void (*log)(void *, const char *, int, const char *, const char *, ...); } Callbacks;

void *fmi2Instantiate(const char *name, int kind, const char *id, const char *folder, const Callbacks *callbacks, int visible, int logging) {
    Table *table = calloc(1, sizeof(Table));
    table->gain = 2.0;
    table->log = callbacks->log;
    return table;
}
void fmi2FreeInstance(void *table) { free(table); }
int fmi2SetReal(Table *table, const unsigned *references, size_t count, const double *values) {
    for (size_t i = 0; i < count; i++) *(references[i] == 0 ? &table->speed : &table->gain) = values[i];
    return 0;
}
int fmi2SetBoolean(Table *table, const unsigned *references, size_t count, const int *values) { table->brake = values[0]; return 0; }
int fmi2GetReal(Table *table, const unsigned *references, size_t count, double *values) {
    for (size_t i = 0; i < count; i++) values[i] = references[i] == 3 ? table->position : table->gain * table->speed;
    return 0;
}
int fmi2DoStep(Table *table, double time, double step, int keep) {
    if (table->speed > 300.0) {
        table->log(NULL, "table", 3, "error", "the table is too fast");
        return 3;
    }
    if (!table->brake) table->position += step * table->speed;
    return 0;
}
const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
#define YES(name) int fmi2##name(void) { return 0; }
YES(SetupExperiment) YES(EnterInitializationMode) YES(ExitInitializationMode) YES(Terminate) YES(Reset) YES(SetDebugLogging)
YES(GetInteger) YES(GetBoolean) YES(GetString) YES(SetInteger) YES(SetString) YES(GetFMUstate) YES(SetFMUstate) YES(FreeFMUstate)
YES(SerializedFMUstateSize) YES(SerializeFMUstate) YES(DeSerializeFMUstate) YES(GetDirectionalDerivative) YES(SetRealInputDerivatives)
YES(GetRealOutputDerivatives) YES(CancelStep) YES(GetStatus) YES(GetRealStatus) YES(GetIntegerStatus) YES(GetBooleanStatus)
YES(GetStringStatus)
