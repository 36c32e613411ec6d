/* Stand-ins for two makers' libraries, from their published interfaces: the functions that the
   drivers call, over one device each (two for DHD) that a test moves and looks at. */
#include <pthread.h>
#include <string.h>
#include <unistd.h>

/* What a test sets and reads. */
double fake_position[3], fake_velocity[3], fake_force[2][3];
int fake_buttons, fake_gone, fake_count = 1, fake_opened, fake_forces_on, fake_stalled;
int fake_result, fake_error, fake_enabled, fake_expert, fake_refuses;
unsigned char fake_watchdog = 7;
char fake_name[32];

/* DHD */
int dhdGetDeviceCount(void) { return fake_count; }
int dhdOpenID(char index) { return fake_gone ? -1 : (fake_opened++, index); }
int dhdClose(char id) { (void)id; fake_opened--; return 0; }
int dhdEnableForce(unsigned char on, char id) {
  (void)id, fake_forces_on = on, fake_enabled += on;
  return 0;
}
int dhdEnableExpertMode(void) { fake_expert = 1; return 0; }
int dhdDisableExpertMode(void) { fake_expert = 0; return 0; }
int dhdSetWatchdog(unsigned char value, char id) {
  (void)id;
  if (!fake_expert || fake_refuses) return -1;
  fake_watchdog = value;
  return 0;
}
int dhdGetWatchdog(unsigned char *value, char id) { (void)id; *value = fake_watchdog; return 0; }
const char *dhdErrorGetLastStr(void) { return "communication error"; }
static int get(const double *from, double *x, double *y, double *z) {
  while (fake_stalled) usleep(1000);
  if (fake_gone) return -1;
  *x = from[0], *y = from[1], *z = from[2];
  return fake_result;
}
int dhdGetPosition(double *x, double *y, double *z, char id) {
  (void)id;
  return get(fake_position, x, y, z);
}
int dhdGetLinearVelocity(double *x, double *y, double *z, char id) {
  (void)id;
  return get(fake_velocity, x, y, z);
}
int dhdSetForce(double x, double y, double z, char id) {
  if (fake_gone) return -1;
  fake_force[(int)id][0] = x, fake_force[(int)id][1] = y, fake_force[(int)id][2] = z;
  return fake_result;
}
int dhdGetButton(int index, char id) { (void)id; return (fake_buttons >> index) & 1; }

/* HD */
typedef struct { unsigned code; int internal; unsigned device; } error_info;
typedef unsigned (*callback)(void *);
static callback scheduled;
static pthread_t servo;
static int runs;

unsigned hdInitDevice(const char *name) {
  if (name) strncpy(fake_name, name, sizeof fake_name - 1);
  return fake_count ? 0 : 0xFFFFFFFFu;
}
error_info hdGetError(void) { error_info e = {(unsigned)fake_error, 0, 0}; return e; }
void hdEnable(unsigned what) { fake_forces_on = what == 0x4000; }
void hdBeginFrame(unsigned device) { (void)device; }
void hdEndFrame(unsigned device) { (void)device; }
void hdGetDoublev(unsigned what, double *out) {
  memcpy(out, what == 0x2050 ? fake_position : fake_velocity, sizeof fake_position);
}
void hdGetIntegerv(unsigned what, int *out) { *out = what == 0x2000 ? fake_buttons : 0; }
void hdSetDoublev(unsigned what, const double *in) {
  if (what == 0x2700) memcpy(fake_force[0], in, sizeof fake_force[0]);
}
unsigned long hdScheduleAsynchronous(callback call, void *data, unsigned short priority) {
  (void)data, (void)priority;
  scheduled = call;
  return 1;
}
void hdUnschedule(unsigned long handle) { (void)handle; scheduled = 0; }
static void *serve(void *data) {
  while (runs) {
    if (!fake_stalled && scheduled && scheduled(0) == 0) break;
    usleep(1000);
  }
  return data;
}
void hdStartScheduler(void) { runs = 1; pthread_create(&servo, 0, serve, 0); }
void hdStopScheduler(void) {
  /* The library ends its servo thread with the force off. */
  if (runs) { runs = 0; pthread_join(servo, 0); }
  memset(fake_force[0], 0, sizeof fake_force[0]);
}
void hdDisableDevice(unsigned device) { (void)device; fake_forces_on = 0; }
