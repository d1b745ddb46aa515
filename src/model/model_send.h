// ---------------------------------------------------------------------------
// model_send.h : sends the model of rank 0 to other ranks, in parts
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_MODEL_SEND_H
#define MPFE_MODEL_MODEL_SEND_H

#include "model/model.h"

// model_send, model_receive : from rank 0 to another one
void model_send(Model& m, int rank);
Model model_receive();

#endif
